// The logged attitude's turn against the gyroscope's, by intervals of 0.1 s: the change of the
// attitude filter's error (attitude_errors.h).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

inline constexpr TimeNs kGyroInterval = kNsPerSecond / 10;
inline constexpr double kMostGyroGap = 0.25;  // s, of either stream

// Sums over what both streams cover of an interval, in axes of E' where not stated.
struct GyroInterval {
  double seconds = 0.0;
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();    // rad, of the attitude less the gyroscope's
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();    // s, integral of R_Ep_I
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();    // rad s, integral of the accelerometer's tilt
                                                     // against the filter's
  Eigen::Vector3d pull_I = Eigen::Vector3d::Zero();  // rad s, the same in I
  Eigen::Vector3d tilt = Eigen::Vector3d::Zero();    // rad, of the vehicle, at the end
};

// From the first IMU sample on. `latency`: s, of the attitude.
std::vector<GyroInterval> GyroIntervals(const std::vector<ImuSample>& imu,
                                        const std::vector<AttitudeSample>& attitude,
                                        double latency = 0.0, double max_gap = kMostGyroGap);

// What the turn goes with, three rows an interval: the gyroscope's bias (rad/s, in I), what the
// filter feeds back of the accelerometer's tilt (1/s) and of its integral (1/s^2; Li et al. 2019,
// fig. 3).
inline constexpr int kFeedback = 3;
Eigen::Matrix<double, Eigen::Dynamic, 5> FilterSlopes(const std::vector<GyroInterval>& intervals);

}  // namespace trueline
