#include "problems/vgd/line_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cost_functions/huber.h"

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

}  // namespace trueline
