#include "problems/smoother/evidence_maximum.h"

#include <algorithm>

namespace trueline {
namespace {

constexpr double kSettled = 0.1;  // in reaches: a smaller step ends the search

struct Parabola {
  Eigen::VectorXd gradient;
  Eigen::MatrixXd curvature;  // minus the second derivative, made positive definite
};

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
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double both = value(at + unit.col(i) + unit.col(j));
      second(i, j) = second(j, i) = both - up[i] - up[j] + middle;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(-second);
  const Eigen::VectorXd sizes = eigen.eigenvalues().cwiseAbs().cwiseMax(1e-6);
  return {0.5 * (up - down),
          eigen.eigenvectors() * sizes.asDiagonal() * eigen.eigenvectors().transpose()};
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
    Eigen::VectorXd step = parabola.curvature.ldlt().solve(parabola.gradient);
    const double size = step.cwiseProduct(reach).cwiseAbs().maxCoeff();
    step *= std::min(1.0, longest / std::max(size, 1e-300));
    z += step;
    maximum.converged = step.cwiseAbs().maxCoeff() < kSettled;
  }
  maximum.at = z.cwiseProduct(reach);
  maximum.cov = reach.asDiagonal() * parabola.curvature.inverse() * reach.asDiagonal();
  return maximum;
}

}  // namespace trueline
