#include "problems/simulation/attitude_for_thrust.h"

#include <cmath>

namespace trueline::simulation {

Eigen::Quaterniond AttitudeFor(const Eigen::Vector3d& thrust_E, double heading) {
  const Eigen::Vector3d z = -thrust_E.normalized();
  const Eigen::Vector3d y =
      z.cross(Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0)).normalized();
  Eigen::Matrix3d R_E_B;
  R_E_B << y.cross(z), y, z;
  return Eigen::Quaterniond(R_E_B);
}

}  // namespace trueline::simulation
