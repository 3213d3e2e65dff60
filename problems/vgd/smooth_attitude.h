// The logged attitude without the noise that its gyroscope contradicts.
//
// A logged attitude's errors of a few seconds are part of its tilt. Where the tilt is a regressor
// (a share of it is estimated), they would be taken for a share: errors in variables.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// rad in E', level: the turn that takes down to the body's z axis.
Eigen::Vector3d TiltOf(const Eigen::Quaterniond& q_Ep_I);

// The part of an error that changes faster than `memory` s. changes[i] (rad, say) is the error's
// change over seconds[i], before entry i + 1 of the result. It is filtered forwards and backwards,
// so that a constant rate, as of a gyroscope's bias, leaves nothing. No memory: all zero.
std::vector<Eigen::Vector3d> FastPart(const std::vector<Eigen::Vector3d>& changes,
                                      const std::vector<double>& seconds, double memory);

// s over which a gyroscope says more of the tilt than the logged attitude: until its error grows to
// 15 % of the tilt's rms (rad), at most 5 s; 0 for a poor one. `changes` as above: what both
// disagree by.
double MemoryOfGyro(const std::vector<Eigen::Vector3d>& changes, const std::vector<double>& seconds,
                    double tilt_rms);

// `attitude` with changes faster than MemoryOfGyro by the gyroscope. Where `imu` doesn't cover it,
// or has gaps above `max_gap` s, it stays as it is.
std::vector<AttitudeSample> SmoothAttitude(const std::vector<ImuSample>& imu,
                                           const std::vector<AttitudeSample>& attitude,
                                           double max_gap = 0.25);

}  // namespace trueline
