#include "problems/rotor_data/rotor_noise.h"

#include "problems/common/yaml_options.h"

namespace trueline {

void ReadRotorNoise(const YamlMap& map, RotorNoise* noise) {
  ReadPositive(map, "sigma_accel", &noise->accel);
  ReadPositive(map, "sigma_gyro", &noise->gyro);
  ReadPositive(map, "sigma_position", &noise->position);
  ReadPositive(map, "sigma_attitude", &noise->attitude);
  ReadPositive(map, "force_density", &noise->force_density);
  ReadPositive(map, "angular_density", &noise->angular_density);
  map.Finish();
}

YAML::Node ToYaml(const RotorNoise& noise) {
  YAML::Node node;
  node["sigma_accel"] = noise.accel;
  node["sigma_gyro"] = noise.gyro;
  node["sigma_position"] = noise.position;
  node["sigma_attitude"] = noise.attitude;
  node["force_density"] = noise.force_density;
  node["angular_density"] = noise.angular_density;
  return node;
}

}  // namespace trueline
