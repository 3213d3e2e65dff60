#include "problems/smoother/evidence_maximum.h"

#include <algorithm>

namespace trueline {
namespace {

// A step that promises less of a gain ends the search. It is the last one.
constexpr double kSettled = 0.1;
constexpr int kHalvings = 3;
// Second derivatives by two unknowns are computed where a step promises less: far from the maximum
// they cost more than they tell.
constexpr double kNear = 10.0;

struct Parabola {
  double middle;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd curvature;  // minus the second derivative, made positive definite

  Eigen::VectorXd Step() const { return curvature.ldlt().solve(gradient); }
  double Promises(const Eigen::VectorXd& step) const { return 0.5 * gradient.dot(step); }
};

Eigen::MatrixXd PositiveDefinite(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(symmetric);
  const Eigen::VectorXd sizes = eigen.eigenvalues().cwiseAbs().cwiseMax(1e-6);
  return eigen.eigenvectors() * sizes.asDiagonal() * eigen.eigenvectors().transpose();
}

// All in units of `reach`.
Parabola FitParabola(const std::function<double(const Eigen::VectorXd&)>& value,
                     const Eigen::VectorXd& at) {
  const Eigen::Index n = at.size();
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(n, n);
  const double middle = value(at);
  Eigen::VectorXd up(n), down(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    up[i] = value(at + unit.col(i));
    down[i] = value(at - unit.col(i));
  }
  Eigen::MatrixXd second = (up + down).asDiagonal();
  second.diagonal().array() -= 2.0 * middle;
  const Parabola far{middle, 0.5 * (up - down), PositiveDefinite(-second)};
  if (far.Promises(far.Step()) > kNear) return far;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double both = value(at + unit.col(i) + unit.col(j));
      second(i, j) = second(j, i) = both - up[i] - up[j] + middle;
    }
  }
  return {middle, far.gradient, PositiveDefinite(-second)};
}

}  // namespace

EvidenceMaximum MaximiseEvidence(const std::function<double(const Eigen::VectorXd&)>& log_p,
                                 const Eigen::VectorXd& start, const Eigen::VectorXd& reach,
                                 double longest, int max_steps) {
  EvidenceMaximum maximum;
  const auto value = [&](const Eigen::VectorXd& z) {
    ++maximum.evaluations;
    return log_p(z.cwiseProduct(reach));
  };
  Eigen::VectorXd z = start.cwiseQuotient(reach);
  Parabola parabola;
  for (int k = 0; k < max_steps && !maximum.converged; ++k) {
    parabola = FitParabola(value, z);
    Eigen::VectorXd step = parabola.Step();
    const double size = step.cwiseProduct(reach).cwiseAbs().maxCoeff();
    step *= std::min(1.0, longest / std::max(size, 1e-300));
    for (int i = 0; i < kHalvings && parabola.Promises(step) > kSettled; ++i) {
      if (value(z + step) >= parabola.middle) break;
      step *= 0.5;
    }
    maximum.converged = parabola.Promises(step) < kSettled;
    z += step;
  }
  maximum.at = z.cwiseProduct(reach);
  maximum.cov = reach.asDiagonal() * parabola.curvature.inverse() * reach.asDiagonal();
  return maximum;
}

}  // namespace trueline
