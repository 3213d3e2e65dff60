// Options of VGD-kinematic in addition to those it shares with VGD (window, loss, solver, passes);
// the YAML keys are in the mapping `kinematic`.
#pragma once

#include "problems/common/yaml_archive.h"
#include "problems/vgd/imu_noise.h"

namespace trueline {

// Zero-mean priors, with hard bounds at kBoundSigmas, as VGD's. Biases by the uniform ranges of
// Table 2 in Li et al. 2019 (+-1 m/s^2, +-3 deg/s; sigma is width over sqrt(12)).
struct KinematicOptions {
  // The attitude at the window's start as an unknown, with the AHRS's as mean. The paper (eq. 38)
  // assumes that the AHRS is exact there.
  bool initial_attitude = true;
  double accel_bias_sigma = 0.58;  // m/s^2
  double gyro_bias_sigma = 0.030;  // rad/s
  double tilt_sigma = 0.040;       // rad
  double heading_sigma = 0.031;    // rad
  static constexpr double kBoundSigmas = 3.46;
  // Widens the covariance only; the fit itself is the paper's rigid one. Only white noise is used.
  ImuNoise noise;
  bool gyro_from_log = true;  // whether noise.gyro_scatter is measured on the log
};

void Serialize(YamlArchive* a, KinematicOptions* o);

}  // namespace trueline
