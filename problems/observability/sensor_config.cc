#include "problems/observability/sensor_config.h"

#include "problems/common/yaml_options.h"

namespace trueline {
SensorSet ReadSensorNoise(const YamlMap& map) {
  SensorSet s;
  ReadPositive(map, "imu_rate", &s.imu_rate);
  ReadPositive(map, "sigma_accel", &s.sigma_accel);
  ReadPositive(map, "sigma_gyro", &s.sigma_gyro);
  ReadPositive(map, "pose_rate", &s.pose_rate);
  ReadPositive(map, "sigma_position", &s.sigma_position);
  ReadPositive(map, "sigma_attitude", &s.sigma_attitude);
  map.Finish();
  return s;
}

SensorSet WithSensors(SensorSet noise, const std::vector<std::string>& names, const YamlMap& map,
                      const std::string& key) {
  noise.imu = noise.position = noise.pose = false;
  for (const std::string& name : names) {
    if (name == "imu") {
      noise.imu = true;
    } else if (name == "position") {
      noise.position = true;
    } else if (name == "pose") {
      noise.pose = true;
    } else {
      map.Fail(key, fmt::format("'{}' is no sensor; use imu, position, pose", name));
    }
  }
  if (names.empty()) map.Fail(key, "names no sensor; use imu, position, pose");
  return noise;
}

}  // namespace trueline
