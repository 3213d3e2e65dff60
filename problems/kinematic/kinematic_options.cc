#include "problems/kinematic/kinematic_options.h"

#include <cmath>

#include "problems/common/units.h"
#include "problems/common/yaml_options.h"

namespace trueline {
KinematicOptions ReadKinematicOptions(const YamlMap& map) {
  KinematicOptions options;
  ReadOption(map, "initial_attitude", &options.initial_attitude);
  ReadPositive(map, "accel_bias_sigma_mps2", &options.accel_bias_sigma);
  ReadPositive(map, "gyro_bias_sigma_deg_per_s", &options.gyro_bias_sigma, kDegree);
  ReadPositive(map, "tilt_sigma_deg", &options.tilt_sigma, kDegree);
  ReadPositive(map, "heading_sigma_deg", &options.heading_sigma, kDegree);
  ReadPositive(map, "bound_sigmas", &options.bound_sigmas);
  ReadNotNegative(map, "accel_noise_mps2_per_sqrt_hz", &options.noise.accel);
  ReadNotNegative(map, "gyro_noise_deg_per_s_per_sqrt_hz", &options.noise.gyro, kDegree);
  ReadOption(map, "gyro_from_log", &options.gyro_from_log);
  map.Finish();
  return options;
}

YAML::Node ToYaml(const KinematicOptions& options) {
  YAML::Node node;
  node["initial_attitude"] = options.initial_attitude;
  node["accel_bias_sigma_mps2"] = options.accel_bias_sigma;
  node["gyro_bias_sigma_deg_per_s"] = options.gyro_bias_sigma / kDegree;
  node["tilt_sigma_deg"] = options.tilt_sigma / kDegree;
  node["heading_sigma_deg"] = options.heading_sigma / kDegree;
  node["bound_sigmas"] = options.bound_sigmas;
  node["accel_noise_mps2_per_sqrt_hz"] = options.noise.accel;
  node["gyro_noise_deg_per_s_per_sqrt_hz"] = options.noise.gyro / kDegree;
  node["gyro_from_log"] = options.gyro_from_log;
  return node;
}

}  // namespace trueline
