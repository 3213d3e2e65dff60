#include "problems/observability/rotor_driven_system.h"

#include <fmt/format.h>

#include "problems/log/samples.h"

namespace trueline {
namespace {

double RateOf(std::size_t samples, double duration) {
  return duration > 0.0 ? static_cast<double>(samples) / duration : 0.0;
}

}  // namespace

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

SensorSet SensorsOf(const FlightLog& log) {
  SensorSet sensors;
  const auto set = [](double rate, double* at) {
    if (rate > 0.0) *at = rate;
  };
  const auto duration = [](const auto& samples) {
    return SecondsBetween(samples.front().t, samples.back().t);
  };
  if (!log.imu.empty()) set(RateOf(log.imu.size(), duration(log.imu)), &sensors.imu_rate);
  const auto& poses = log.pose.empty() ? log.mocap : log.pose;
  if (!poses.empty()) {
    set(RateOf(poses.size(), duration(poses)), &sensors.pose_rate);
  } else if (!log.fixes.empty()) {
    set(RateOf(log.fixes.size(), duration(log.fixes)), &sensors.pose_rate);
    sensors.sigma_position = MedianSigma(log.fixes);
  }
  return sensors;
}

}  // namespace trueline
