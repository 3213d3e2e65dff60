#include "problems/kinematic/kinematic_options.h"

#include <cmath>

#include "problems/common/yaml_options.h"

namespace trueline {
namespace {

constexpr double kDegree = M_PI / 180.0;

}  // namespace

KinematicOptions ReadKinematicOptions(const YamlMap& map) {
  KinematicOptions options;
  ReadOption(map, "initial_attitude", &options.initial_attitude);
  ReadPositive(map, "accel_bias_sigma_mps2", &options.accel_bias_sigma);
  ReadPositive(map, "gyro_bias_sigma_deg_per_s", &options.gyro_bias_sigma, kDegree);
  ReadPositive(map, "tilt_sigma_deg", &options.tilt_sigma, kDegree);
  ReadPositive(map, "heading_sigma_deg", &options.heading_sigma, kDegree);
  ReadPositive(map, "bound_sigmas", &options.bound_sigmas);
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
  return node;
}

}  // namespace trueline
