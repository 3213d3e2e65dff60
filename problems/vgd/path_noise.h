// Effect of IMU noise on an integrated path, which a rigid integration cannot follow.
#pragma once

#include <vector>

#include "cost_functions/kinematic_fix_residual.h"
#include "problems/vgd/imu_noise.h"

namespace trueline {

// Deviations of (p, v) at every node (rows 6 i ... 6 i + 5) for independent unit normal noises
// (columns): D D' is the covariance of the true path less the integrated one. Between two nodes the
// gyroscope's white noise rotates all later specific force, and the accelerometer's changes the
// velocity. With P and V the changes of p and v by specific force alone from then on,
//
//   dp = dv t - [P]x dtheta,  dv(t) = dv - [V]x dtheta.
//
// The gyroscope's three axes get their mean spectrum.
Eigen::MatrixXd PathDeviations(const std::vector<KinematicNode>& nodes, const ImuNoise& noise,
                               double gravity);

}  // namespace trueline
