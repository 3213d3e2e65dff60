#include "problems/observability/sensor_config.h"

#include <fmt/format.h>

namespace trueline {

void Serialize(YamlArchive* a, SensorSet* s) {
  a->Positive("imu_rate", &s->imu_rate);
  a->Positive("sigma_accel", &s->sigma_accel);
  a->Positive("sigma_gyro", &s->sigma_gyro);
  a->Positive("pose_rate", &s->pose_rate);
  a->Positive("sigma_position", &s->sigma_position);
  a->Positive("sigma_attitude", &s->sigma_attitude);
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
