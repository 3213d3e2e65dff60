#include "problems/vgd/path_noise.h"

#include <cmath>

#include "cost_functions/models/rotation.h"

namespace trueline {

Eigen::MatrixXd PathDeviations(const std::vector<KinematicNode>& nodes, const ImuNoise& noise,
                               double gravity) {
  const auto count = static_cast<Eigen::Index>(nodes.size());
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(6 * count, 6 * count);
  const Eigen::Vector3d g(0.0, 0.0, gravity);
  const double sigma_gyro = std::sqrt(noise.GyroSpectrum().mean());
  for (Eigen::Index k = 0; k + 1 < count; ++k) {
    const double root = std::sqrt(nodes[k + 1].elapsed - nodes[k].elapsed);
    const auto& from = nodes[k].value;
    for (Eigen::Index i = k + 1; i < count; ++i) {
      const double t = nodes[i].elapsed - nodes[k].elapsed;
      const auto& to = nodes[i].value;
      const Eigen::Vector3d V = to.tail<3>() - from.tail<3>() - g * t;
      const Eigen::Vector3d P =
          to.head<3>() - from.head<3>() - from.tail<3>() * t - g * (0.5 * t * t);
      auto effect = D.block<6, 6>(6 * i, 6 * k);
      effect.topLeftCorner<3, 3>() = Skew<double>(P) * (-sigma_gyro * root);
      effect.bottomLeftCorner<3, 3>() = Skew<double>(V) * (-sigma_gyro * root);
      effect.topRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (noise.accel * root * t);
      effect.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (noise.accel * root);
    }
  }
  return D;
}

}  // namespace trueline
