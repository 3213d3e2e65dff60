// Noise of an IMU between fixes, as root spectral densities for each axis.
#pragma once

#include <Eigen/Core>

namespace trueline {

struct ImuNoise {
  double accel = 0.02;        // m/s^2/sqrt(Hz)
  double gyro = 0.001;        // rad/s/sqrt(Hz)
  double accel_walk = 0.002;  // m/s^3/sqrt(Hz), of the Wiener process b_a
  double gyro_walk = 1e-4;    // rad/s^2/sqrt(Hz), of the Wiener process b_g
  // rad/s/sqrt(Hz), GyroScatter's value for the log; the larger of this and `gyro` applies.
  Eigen::Vector3d gyro_scatter = Eigen::Vector3d::Zero();

  // rad^2/s^2/Hz for each axis of I.
  Eigen::Vector3d GyroSpectrum() const { return gyro_scatter.cwiseMax(gyro).cwiseAbs2(); }
};

}  // namespace trueline
