// The attitude that a wanted thrust asks for.
#pragma once

#include <Eigen/Geometry>

namespace trueline::simulation {

// R_E_B as a quaternion: -z_B along `thrust_E`, x_B towards `heading` (rad).
Eigen::Quaterniond AttitudeFor(const Eigen::Vector3d& thrust_E, double heading);

}  // namespace trueline::simulation
