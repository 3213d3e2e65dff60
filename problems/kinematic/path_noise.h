// What IMU noise does to an integrated path, which a rigid integration cannot follow.
#pragma once

#include <vector>

#include "cost_functions/kinematic_fix_residual.h"
#include "problems/window/imu_noise.h"

namespace trueline {

// Deviations of (p, v) at every node (rows 6 i ... 6 i + 5) for independent unit normal noises
// (columns): D D' is the covariance of what the true path has beyond the integrated one. Between
// two nodes the gyroscope's white noise turns all later specific force, the accelerometer's adds
// velocity: with P and V what specific force alone adds to p and v from then on,
//   dp = dv t - [P]x dtheta,  dv(t) = dv - [V]x dtheta.
// The gyroscope's three axes are taken alike (their mean spectrum).
Eigen::MatrixXd PathDeviations(const std::vector<KinematicNode>& nodes, const ImuNoise& noise,
                               double gravity);

}  // namespace trueline
