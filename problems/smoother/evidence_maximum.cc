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

Eigen::MatrixXd PositiveDefinite(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(symmetric);
  const Eigen::VectorXd sizes = eigen.eigenvalues().cwiseAbs().cwiseMax(1e-6);
  return eigen.eigenvectors() * sizes.asDiagonal() * eigen.eigenvectors().transpose();
}

// All in units of `reach`.
EvidenceParabola FitParabola(const std::function<double(const Eigen::VectorXd&)>& value,
                             const Eigen::VectorXd& at) {
  const int n = static_cast<int>(at.size());
  const std::vector<Eigen::VectorXd> offsets = ParabolaOffsets(n);
  std::vector<double> values;
  const auto evaluate = [&](std::size_t count) {
    while (values.size() < count) values.push_back(value(at + offsets[values.size()]));
    return ParabolaThrough(values, n);
  };
  EvidenceParabola far = evaluate(2 * at.size() + 1);
  return far.Promises(far.Step()) > kNear ? far : evaluate(offsets.size());
}

}  // namespace

std::vector<Eigen::VectorXd> ParabolaOffsets(int n) {
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(n, n);
  std::vector<Eigen::VectorXd> offsets = {Eigen::VectorXd::Zero(n)};
  for (int i = 0; i < n; ++i) {
    offsets.emplace_back(unit.col(i));
    offsets.emplace_back(-unit.col(i));
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) offsets.emplace_back(unit.col(i) + unit.col(j));
  }
  return offsets;
}

EvidenceParabola ParabolaThrough(const std::vector<double>& values, int n) {
  const double middle = values.front();
  Eigen::VectorXd up(n), down(n);
  std::size_t at = 1;
  for (int i = 0; i < n; ++i) {
    up[i] = values[at++];
    down[i] = values[at++];
  }
  Eigen::MatrixXd second = (up + down).asDiagonal();
  second.diagonal().array() -= 2.0 * middle;
  for (int i = 0; i < n && at < values.size(); ++i) {
    for (int j = 0; j < i; ++j) {
      second(i, j) = second(j, i) = values[at++] - up[i] - up[j] + middle;
    }
  }
  return {middle, 0.5 * (up - down), PositiveDefinite(-second)};
}

EvidenceMaximum MaximiseEvidence(const std::function<double(const Eigen::VectorXd&)>& log_p,
                                 const Eigen::VectorXd& start, const Eigen::VectorXd& reach,
                                 double longest, int max_steps) {
  EvidenceMaximum maximum;
  const auto value = [&](const Eigen::VectorXd& z) {
    ++maximum.evaluations;
    return log_p(z.cwiseProduct(reach));
  };
  Eigen::VectorXd z = start.cwiseQuotient(reach);
  EvidenceParabola parabola;
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
