// YAML -> sensors.
#include "problems/simulation/config_values.h"

namespace trueline::simulation {

ImuConfig ReadImu(const YamlMap& map) {
  ImuConfig imu;
  ReadPositive(map, "rate", &imu.rate);
  if (imu.rate < 100.0) map.Fail("rate", "the flight is integrated at this rate; use 100 or more");
  ReadNotNegative(map, "accel_noise_density", &imu.accel_noise_density);
  ReadNotNegative(map, "gyro_noise_density", &imu.gyro_noise_density);
  ReadFinite(map, "accel_bias", &imu.accel_bias);
  ReadFinite(map, "gyro_bias", &imu.gyro_bias);
  ReadNotNegative(map, "accel_bias_walk", &imu.accel_bias_walk);
  ReadNotNegative(map, "gyro_bias_walk", &imu.gyro_bias_walk);
  ReadFinite(map, "misalignment", &imu.misalignment);
  imu.accelerometer_in_body_axes = map.Get<bool>("accelerometer_in_body_axes", false);
  const YamlMap vibration = map.ChildOrEmpty("vibration");
  imu.vibration.accel = vibration.Get<std::vector<double>>("accel", {});
  imu.vibration.gyro = vibration.Get<std::vector<double>>("gyro", {});
  vibration.Finish();
  ReadNotNegative(map, "accel_range", &imu.accel_range);
  ReadNotNegative(map, "gyro_range", &imu.gyro_range);
  ReadNotNegative(map, "accel_step", &imu.accel_step);
  ReadNotNegative(map, "gyro_step", &imu.gyro_step);
  map.Finish();
  return imu;
}

AhrsConfig ReadAhrs(const YamlMap& map) {
  AhrsConfig ahrs;
  const std::string kind = map.GetChoice(
      "kind", {"complementary_filter", "drifting_error", "constant_error"}, "complementary_filter");
  ReadNotNegative(map, "rate", &ahrs.rate);
  if (kind == "complementary_filter") {
    ReadPositive(map, "tilt_gain", &ahrs.tilt_gain);
    ReadNotNegative(map, "integral_gain", &ahrs.integral_gain);
    ReadNotNegative(map, "heading_gain", &ahrs.heading_gain);
    ReadFinite(map, "heading_error", &ahrs.heading_error);
  } else {
    ahrs.kind = AhrsKind::kConstantError;
    ReadFinite(map, "constant", &ahrs.constant);
  }
  if (kind == "drifting_error") {
    ahrs.kind = AhrsKind::kDriftingError;
    ReadNotNegative(map, "drift_sigma", &ahrs.drift_sigma);
    ReadPositive(map, "drift_memory", &ahrs.drift_memory);
    ReadNotNegative(map, "drift_density", &ahrs.drift_density);
  }
  map.Finish();
  return ahrs;
}

namespace {

void ReadFixNoise(const YamlMap& map, DetectorConfig* detector) {
  ReadNotNegative(map, "sigma_factor", &detector->sigma_factor);
  ReadPositive(map, "sigma_floor", &detector->sigma_floor);
  ReadNotNegative(map, "outlier_share", &detector->outlier_share);
  if (detector->outlier_share > 1.0) map.Fail("outlier_share", "is a share: 0 to 1");
  ReadPositive(map, "outlier_size", &detector->outlier_size);
  ReadNotNegative(map, "tail_dof", &detector->tail_dof);
  ReadFinite(map, "latency", &detector->latency);
  ReadNotNegative(map, "jitter", &detector->jitter);
}

}  // namespace

DetectorConfig ReadDetector(const YamlMap& map) {
  DetectorConfig detector;
  const auto fixes = map.Get<std::vector<int>>("fixes", {detector.fixes_min, detector.fixes_max});
  if (fixes.size() != 2 || fixes[0] < 0 || fixes[1] < fixes[0]) {
    map.Fail("fixes", "needs the least and the greatest number of fixes a view, such as [15, 20]");
  }
  detector.fixes_min = fixes[0];
  detector.fixes_max = fixes[1];
  ReadPositive(map, "max_rate", &detector.max_rate);
  ReadNotNegative(map, "range_min", &detector.range_min);
  ReadPositive(map, "range_max", &detector.range_max);
  ReadPositive(map, "fov_horizontal_deg", &detector.fov_horizontal_deg);
  ReadPositive(map, "fov_vertical_deg", &detector.fov_vertical_deg);
  ReadFinite(map, "camera_pitch_deg", &detector.camera_pitch_deg);
  ReadPositive(map, "max_view_deg", &detector.max_view_deg);
  ReadFixNoise(map, &detector);
  detector.turned_by_ahrs = map.GetChoice("turned_by", {"truth", "ahrs"}, "truth") == "ahrs";
  map.Finish();
  return detector;
}

}  // namespace trueline::simulation
