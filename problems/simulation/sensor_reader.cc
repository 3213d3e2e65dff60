// YAML -> sensors.
#include "problems/simulation/config_values.h"

namespace trueline::simulation {

void Serialize(YamlArchive* a, ImuConfig* imu) {
  a->Positive("rate", &imu->rate);
  a->Require(imu->rate >= 100.0, "rate", "the flight is integrated at this rate; use 100 or more");
  a->NotNegative("accel_noise_density", &imu->accel_noise_density);
  a->NotNegative("gyro_noise_density", &imu->gyro_noise_density);
  a->Value("accel_bias", &imu->accel_bias);
  a->Value("gyro_bias", &imu->gyro_bias);
  a->NotNegative("accel_bias_walk", &imu->accel_bias_walk);
  a->NotNegative("gyro_bias_walk", &imu->gyro_bias_walk);
  a->Value("misalignment", &imu->misalignment);
  a->Map("vibration", [vibration = &imu->vibration](YamlArchive* map) {
    map->Value("accel", &vibration->accel);
    map->Value("gyro", &vibration->gyro);
  });
  a->NotNegative("accel_range", &imu->accel_range);
  a->NotNegative("gyro_range", &imu->gyro_range);
  a->NotNegative("accel_step", &imu->accel_step);
  a->NotNegative("gyro_step", &imu->gyro_step);
}

void Serialize(YamlArchive* a, AhrsConfig* ahrs) {
  a->Choice("kind", &ahrs->kind,
            {{"complementary_filter", AhrsKind::kComplementaryFilter},
             {"drifting_error", AhrsKind::kDriftingError},
             {"constant_error", AhrsKind::kConstantError}});
  a->NotNegative("rate", &ahrs->rate);
  if (ahrs->kind == AhrsKind::kComplementaryFilter) {
    a->Positive("tilt_gain", &ahrs->tilt_gain);
    a->NotNegative("integral_gain", &ahrs->integral_gain);
    a->NotNegative("heading_gain", &ahrs->heading_gain);
    a->Value("heading_error", &ahrs->heading_error);
    return;
  }
  a->Value("constant", &ahrs->constant);
  if (ahrs->kind == AhrsKind::kConstantError) return;
  a->NotNegative("drift_sigma", &ahrs->drift_sigma);
  a->Positive("drift_memory", &ahrs->drift_memory);
  a->NotNegative("drift_density", &ahrs->drift_density);
}

void Serialize(YamlArchive* a, DetectorConfig* detector) {
  std::vector<int> fixes = {detector->fixes_min, detector->fixes_max};
  a->Value("fixes", &fixes);
  a->Require(fixes.size() == 2 && fixes[0] >= 0 && fixes[1] >= fixes[0], "fixes",
             "needs the least and the greatest number of fixes a view, such as [15, 20]");
  detector->fixes_min = fixes[0];
  detector->fixes_max = fixes[1];
  a->Positive("max_rate", &detector->max_rate);
  a->NotNegative("range_min", &detector->range_min);
  a->Positive("range_max", &detector->range_max);
  a->Positive("fov_horizontal_deg", &detector->fov_horizontal_deg);
  a->Positive("fov_vertical_deg", &detector->fov_vertical_deg);
  a->Value("camera_pitch_deg", &detector->camera_pitch_deg);
  a->Positive("max_view_deg", &detector->max_view_deg);
  a->NotNegative("sigma_factor", &detector->sigma_factor);
  a->Positive("sigma_floor", &detector->sigma_floor);
  a->NotNegative("outlier_share", &detector->outlier_share);
  a->Require(detector->outlier_share <= 1.0, "outlier_share", "is a share: 0 to 1");
  a->Positive("outlier_size", &detector->outlier_size);
  a->NotNegative("tail_dof", &detector->tail_dof);
  a->Value("latency", &detector->latency);
  a->NotNegative("jitter", &detector->jitter);
  a->Choice("turned_by", &detector->turned_by_ahrs, {{"truth", false}, {"ahrs", true}});
}

void Serialize(YamlArchive* a, GnssConfig* gnss) {
  a->NotNegative("rate", &gnss->rate);
  a->NotNegative("sigma", &gnss->sigma);
  a->Positive("correlation_time", &gnss->correlation_time);
  a->NotNegative("white_sigma", &gnss->white_sigma);
  a->Positive("stated_sigma", &gnss->stated_sigma);
  a->Value("latency", &gnss->latency);
  a->NotNegative("latency_jitter", &gnss->latency_jitter);
  a->NotNegative("wave", &gnss->wave);
  a->Positive("wave_period", &gnss->wave_period);
  a->NotNegative("jump", &gnss->jump);
  a->Positive("jump_interval", &gnss->jump_interval);
  a->NotNegative("outlier_share", &gnss->outlier_share);
  a->Require(gnss->outlier_share <= 1.0, "outlier_share", "is a share: 0 to 1");
  a->NotNegative("outlier_size", &gnss->outlier_size);
}

}  // namespace trueline::simulation
