// Options of VGD-kinematic beside those that it shares with VGD (window, loss, solver, passes);
// the YAML keys stand in the mapping `kinematic`.
#pragma once

#include "problems/common/strict_yaml.h"

namespace trueline {

// Priors around zero; hard bounds lie at `bound_sigmas` of them, as VGD's do. Biases by the uniform
// ranges of Table 2 in Li et al. 2019 (+-1 m/s^2, +-3 deg/s; sigma is width over sqrt(12)).
struct KinematicOptions {
  // The attitude at the window's start as an unknown around the AHRS's. The paper (eq. 38) leaves
  // it out, which takes the AHRS for true there.
  bool initial_attitude = true;
  double accel_bias_sigma = 0.58;  // m/s^2
  double gyro_bias_sigma = 0.030;  // rad/s
  double tilt_sigma = 0.040;       // rad
  double heading_sigma = 0.031;    // rad
  double bound_sigmas = 3.46;
};

// Strict; calls map.Finish().
KinematicOptions ReadKinematicOptions(const YamlMap& map);
YAML::Node ToYaml(const KinematicOptions& options);

}  // namespace trueline
