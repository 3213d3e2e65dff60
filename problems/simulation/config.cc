// YAML -> SimulationConfig. Every key but `course` may be left out and keeps the default of
// config.h.
#include "problems/simulation/config.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "problems/log/log_yaml.h"
#include "problems/simulation/course.h"
#include "problems/simulation/effects.h"
#include "problems/simulation/forces.h"
#include "problems/simulation/simulate.h"

namespace trueline {
namespace simulation {
namespace {

CoursePoint ReadPoint(const YamlMap& map, bool spline, const CoursePoint& usual) {
  CoursePoint point = usual;
  const auto position = map.Get<std::vector<double>>("position");
  if (position.size() != 2) map.Fail("position", "needs 2 numbers: north and east in m");
  point.position = {position[0], position[1]};
  YamlArchive a(map);
  if (!spline) a.Positive("radius", &point.radius);
  a.Positive("altitude", &point.altitude);
  a.NotNegative("speed", &point.speed);
  if (!spline) a.NotNegative("turn_speed", &point.turn_speed);
  a.Value("gate", &point.gate);
  map.Finish();
  return point;
}

CourseConfig ReadCourse(const YamlMap& map) {
  CourseConfig course;
  CoursePoint usual;
  YamlArchive a(map);
  a.Positive("altitude", &usual.altitude);
  a.NotNegative("speed", &usual.speed);
  usual.turn_speed = usual.speed;
  a.Value("turn_speed", &usual.turn_speed);
  a.Value("radius", &usual.radius);
  a.Positive("along_limit", &course.along_limit);
  a.Positive("lateral_limit", &course.lateral_limit);
  course.spline = map.Has("waypoints");
  if (course.spline && map.Has("corners")) {
    map.Fail("corners", "a course has either corners (lines and arcs) or waypoints (a spline)");
  }
  const std::string key = course.spline ? "waypoints" : "corners";
  for (const YamlMap& point : map.Children(key)) {
    course.points.push_back(ReadPoint(point, course.spline, usual));
  }
  map.Finish();
  const std::string error = CheckCourse(course);
  if (!error.empty()) map.Fail(key, error);
  return course;
}

// An X of four, numbered front right, back left, front left, back right; hover at 800 rad/s.
std::vector<Rotor> DefaultRotors(double mass, double gravity) {
  constexpr double kForward = 0.0925, kRight = 0.115;  // m
  constexpr double kHover = 800.0;                     // rad/s
  const double k_f = mass * gravity / 4.0 / (kHover * kHover);
  const double k_m = 0.016 * k_f;
  const Vector3d up(0.0, 0.0, -1.0);
  return {{{kForward, kRight, 0.0}, up, -1, k_f, k_m},
          {{-kForward, -kRight, 0.0}, up, -1, k_f, k_m},
          {{kForward, -kRight, 0.0}, up, 1, k_f, k_m},
          {{-kForward, kRight, 0.0}, up, 1, k_f, k_m}};
}

VehicleConfig ReadVehicle(const YamlMap& map, double gravity) {
  VehicleConfig vehicle;
  YamlArchive a(map);
  a.Positive("mass", &vehicle.mass);
  a.Value("inertia", &vehicle.inertia);
  a.Require(vehicle.inertia.minCoeff() > 0.0, "inertia", "must be above 0 on each axis");
  a.Positive("motor_lag", &vehicle.motor_lag);
  a.Positive("max_rotor_speed", &vehicle.max_rotor_speed);
  a.Value("drag", &vehicle.drag);
  vehicle.rotors = ReadRotors(map.Children("rotors"));
  if (vehicle.rotors.empty()) vehicle.rotors = DefaultRotors(vehicle.mass, gravity);
  if (vehicle.rotors.size() < 4 || vehicle.rotors.size() > 8) {
    map.Fail("rotors", fmt::format("needs 4 to 8 rotors, found {}", vehicle.rotors.size()));
  }
  map.Finish();
  return vehicle;
}

void ReadRandomise(const YamlMap& map, SimulationConfig* config) {
  std::vector<std::string> known;
  for (const auto& [name, value] : TunableValues(*config)) known.push_back(name);
  for (const std::string& key : map.Keys()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      map.Fail(key,
               fmt::format("can't be drawn at random; use one of: {}", fmt::join(known, ", ")));
    }
    const auto range = map.Get<std::vector<double>>(key);
    if (range.size() != 2 || range[1] < range[0]) map.Fail(key, "needs a range [low, high]");
    config->randomise[key] = {range[0], range[1]};
  }
}

}  // namespace

void Serialize(YamlArchive* a, MotorDriveConfig* drive) {
  a->Positive("full_speed", &drive->full_speed);
  a->Positive("nominal_voltage", &drive->nominal_voltage);
  a->NotNegative("idle", &drive->idle);
  a->Require(drive->idle < 1.0, "idle", "is a share of full_speed, below 1");
  a->NotNegative("voltage", &drive->voltage);
  a->Positive("battery", &drive->battery);
  a->NotNegative("drop", &drive->drop);
  a->NotNegative("sag", &drive->sag);
  a->NotNegative("battery_sigma", &drive->battery_sigma);
  a->Positive("battery_rate", &drive->battery_rate);
}

void Serialize(YamlArchive* a, BladeConfig* blades) {
  a->Value("count", &blades->count);
  a->Require(blades->count >= 2 && blades->count <= 8, "count", "must be 2 to 8 blades");
  a->Positive("radius", &blades->radius);
  a->Positive("chord", &blades->chord);
  a->Value("twist", &blades->twist);
  a->Positive("lift_slope", &blades->lift_slope);
  a->Positive("mass", &blades->mass);
  a->Positive("flap_frequency", &blades->flap_frequency);
  a->Positive("air_density", &blades->air_density);
}

void Serialize(YamlArchive* a, AutopilotConfig* autopilot) {
  a->NotNegative("lead", &autopilot->lead);
}

void Serialize(YamlArchive* a, TurbulenceConfig* turbulence) {
  a->NotNegative("sigma", &turbulence->sigma);
  a->NotNegative("memory", &turbulence->memory);
}

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

}  // namespace simulation

SimulationConfig ReadSimulationConfig(const YamlMap& map) {
  using namespace simulation;  // NOLINT(google-build-using-namespace): its own internals
  SimulationConfig config;
  YamlArchive a(map);
  a.Value("name", &config.name);
  a.Positive("duration", &config.duration);
  a.Require(config.duration <= kLongestFlight, "duration",
            fmt::format("must be at most {} s", kLongestFlight));
  a.NotNegative("warm_up", &config.warm_up);
  a.Positive("gravity", &config.gravity);
  config.course = ReadCourse(map.Child("course"));
  config.vehicle = ReadVehicle(map.ChildOrEmpty("vehicle"), config.gravity);
  a.Nested("autopilot", &config.autopilot);
  a.Nested("turbulence", &config.turbulence);
  a.Nested("imu", &config.imu);
  a.Nested("ahrs", &config.ahrs);
  a.Nested("detector", &config.detector);
  a.Nested("gnss", &config.gnss);
  Serialize(&a, &config.sensors);
  if (map.Has("detector") && config.gnss.rate > 0.0) {
    map.Fail("detector", "is of the gates' camera, which a flight with gnss lacks; leave it out");
  }
  ReadActingEffects(map, ActorsOf(config), &config.effects);
  config.forces = ReadUnnamedForces(map, &config.effects);
  ReadRandomise(map.ChildOrEmpty("randomise"), &config);
  map.Finish();
  return config;
}

}  // namespace trueline
