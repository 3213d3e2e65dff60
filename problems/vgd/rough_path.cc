#include "problems/vgd/rough_path.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cost_functions/huber.h"
#include "cost_functions/models/cubic_path.h"

namespace trueline {

LineFit FitLine(const std::vector<Fix>& fixes, std::size_t first, std::size_t last, TimeNs t) {
  constexpr int kRounds = 10;
  constexpr double kHuber = 1.5;        // in sigmas
  constexpr double kSpeedSigma = 20.0;  // m/s, prior that keeps the fit regular for fixes at one
                                        // instant
  LineFit line{fixes[first].p_E, Eigen::Vector3d::Zero()};
  std::vector<double> weights(last - first + 1, 1.0);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Matrix<double, 2, 3> right = Eigen::Matrix<double, 2, 3>::Zero();
    normal(1, 1) = 1.0 / (kSpeedSigma * kSpeedSigma);
    for (std::size_t i = first; i <= last; ++i) {
      const Eigen::Vector2d row(1.0, SecondsBetween(t, fixes[i].t));
      const double weight = weights[i - first] / (fixes[i].sigma * fixes[i].sigma);
      normal += weight * row * row.transpose();
      right += weight * row * fixes[i].p_E.transpose();
    }
    const Eigen::Matrix<double, 2, 3> solution = normal.ldlt().solve(right);
    line = {solution.row(0).transpose(), solution.row(1).transpose(),
            std::sqrt(normal.inverse()(0, 0))};
    for (std::size_t i = first; i <= last; ++i) {
      const Eigen::Vector3d p = line.p + line.v * SecondsBetween(t, fixes[i].t);
      const double norm = (fixes[i].p_E - p).norm() / fixes[i].sigma;
      weights[i - first] = HuberWeight(kHuber, norm);
    }
  }
  return line;
}

RoughPath::RoughPath(const std::vector<Fix>& fixes, std::span<const Pass> passes)
    : fixes_(fixes), passes_(passes) {}

// A line through the fixes within half a second, at least through a third of the pass: a sparse
// pass must still give a direction.
LineFit RoughPath::NearFixes(const Pass& pass, TimeNs t) const {
  const TimeNs reach = std::max(FromSeconds(0.5), (pass.end - pass.begin) / 3);
  std::size_t first = pass.first, last = pass.last;
  while (first + 2 < last && fixes_[first].t < t - reach) ++first;
  while (last > first + 2 && fixes_[last].t > t + reach) --last;
  return FitLine(fixes_, first, last, t);
}

LineFit RoughPath::At(TimeNs t) const {
  for (std::size_t i = 0; i < passes_.size(); ++i) {
    if (t <= passes_[i].end && (t >= passes_[i].begin || i == 0)) return NearFixes(passes_[i], t);
    if (t > passes_[i].end && i + 1 < passes_.size() && t < passes_[i + 1].begin) {
      const LineFit a = NearFixes(passes_[i], passes_[i].end);
      const LineFit b = NearFixes(passes_[i + 1], passes_[i + 1].begin);
      const double h = SecondsBetween(passes_[i].end, passes_[i + 1].begin);
      const double u = SecondsBetween(passes_[i].end, t) / h;
      return {CubicPath(a.p, a.v, b.p, b.v, h, u), CubicPathVelocity(a.p, a.v, b.p, b.v, h, u)};
    }
  }
  return NearFixes(passes_.back(), t);
}

}  // namespace trueline
