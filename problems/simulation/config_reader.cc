// YAML -> SimulationConfig. Every key may be left out unless it says required in config.h's terms:
// a course needs its points. What is left out keeps the default of config.h.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/simulation/config.h"
#include "problems/simulation/course.h"
#include "problems/simulation/effects.h"
#include "problems/simulation/variant.h"

namespace trueline {
namespace simulation {
namespace {

void Read(const YamlMap& map, const std::string& key, Vector3d* value) {
  *value = map.GetVector3(key, *value);
  if (!value->allFinite()) map.Fail(key, "must be finite numbers");
}

void Read(const YamlMap& map, const std::string& key, double* value) {
  *value = map.Get<double>(key, *value);
  if (!std::isfinite(*value)) map.Fail(key, "must be a finite number");
}

void ReadPositive(const YamlMap& map, const std::string& key, double* value) {
  Read(map, key, value);
  if (*value <= 0.0) map.Fail(key, fmt::format("must be above 0, found {}", *value));
}

void ReadNotNegative(const YamlMap& map, const std::string& key, double* value) {
  Read(map, key, value);
  if (*value < 0.0) map.Fail(key, fmt::format("must be 0 or more, found {}", *value));
}

void ReadNotNegative(const YamlMap& map, const std::string& key, Vector3d* value) {
  Read(map, key, value);
  if (value->minCoeff() < 0.0) map.Fail(key, "must be 0 or more on each axis");
}

CoursePoint ReadPoint(const YamlMap& map, bool spline, const CoursePoint& usual) {
  CoursePoint point = usual;
  const auto position = map.Get<std::vector<double>>("position");
  if (position.size() != 2) map.Fail("position", "needs 2 numbers: north and east in m");
  point.position = {position[0], position[1]};
  if (!spline) ReadPositive(map, "radius", &point.radius);
  ReadPositive(map, "altitude", &point.altitude);
  ReadNotNegative(map, "speed", &point.speed);
  point.turn_speed = usual.turn_speed;
  if (!spline) ReadNotNegative(map, "turn_speed", &point.turn_speed);
  point.gate = map.Get<int>("gate", -1);
  map.Finish();
  return point;
}

CourseConfig ReadCourse(const YamlMap& map) {
  CourseConfig course;
  CoursePoint usual;
  ReadPositive(map, "altitude", &usual.altitude);
  ReadNotNegative(map, "speed", &usual.speed);
  usual.turn_speed = map.Get<double>("turn_speed", usual.speed);
  usual.radius = map.Get<double>("radius", 0.0);
  ReadPositive(map, "along_limit", &course.along_limit);
  ReadPositive(map, "lateral_limit", &course.lateral_limit);
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

Rotor ReadRotor(const YamlMap& map) {
  Rotor rotor;
  rotor.position = map.GetVector3("position");
  rotor.axis = map.GetVector3("axis", {0.0, 0.0, -1.0}).normalized();
  rotor.spin = map.Get<int>("spin");
  if (rotor.spin != 1 && rotor.spin != -1) map.Fail("spin", "must be 1 or -1");
  rotor.k_f = map.Get<double>("k_f");
  rotor.k_m = map.Get<double>("k_m");
  if (rotor.k_f <= 0.0) map.Fail("k_f", "must be above 0 (N s^2)");
  map.Finish();
  return rotor;
}

VehicleConfig ReadVehicle(const YamlMap& map, double gravity) {
  VehicleConfig vehicle;
  ReadPositive(map, "mass", &vehicle.mass);
  Read(map, "inertia", &vehicle.inertia);
  if (vehicle.inertia.minCoeff() <= 0.0) map.Fail("inertia", "must be above 0 on each axis");
  ReadPositive(map, "motor_lag", &vehicle.motor_lag);
  ReadPositive(map, "max_rotor_speed", &vehicle.max_rotor_speed);
  Read(map, "drag", &vehicle.drag);
  for (const YamlMap& rotor : map.Children("rotors")) vehicle.rotors.push_back(ReadRotor(rotor));
  if (vehicle.rotors.empty()) vehicle.rotors = DefaultRotors(vehicle.mass, gravity);
  if (vehicle.rotors.size() < 4 || vehicle.rotors.size() > 8) {
    map.Fail("rotors", fmt::format("needs 4 to 8 rotors, found {}", vehicle.rotors.size()));
  }
  map.Finish();
  return vehicle;
}

AutopilotConfig ReadAutopilot(const YamlMap& map) {
  AutopilotConfig autopilot;
  ReadPositive(map, "position_gain", &autopilot.position_gain);
  ReadPositive(map, "velocity_gain", &autopilot.velocity_gain);
  ReadNotNegative(map, "attitude_gain", &autopilot.attitude_gain);
  ReadNotNegative(map, "rate_gain", &autopilot.rate_gain);
  ReadPositive(map, "disturbance_time", &autopilot.disturbance_time);
  ReadNotNegative(map, "lead", &autopilot.lead);
  ReadPositive(map, "max_tilt", &autopilot.max_tilt);
  map.Finish();
  return autopilot;
}

TurbulenceConfig ReadTurbulence(const YamlMap& map) {
  TurbulenceConfig turbulence;
  ReadNotNegative(map, "sigma", &turbulence.sigma);
  ReadNotNegative(map, "memory", &turbulence.memory);
  map.Finish();
  return turbulence;
}

ImuConfig ReadImu(const YamlMap& map) {
  ImuConfig imu;
  ReadPositive(map, "rate", &imu.rate);
  if (imu.rate < 100.0) map.Fail("rate", "the flight is integrated at this rate; use 100 or more");
  ReadNotNegative(map, "accel_noise_density", &imu.accel_noise_density);
  ReadNotNegative(map, "gyro_noise_density", &imu.gyro_noise_density);
  Read(map, "accel_bias", &imu.accel_bias);
  Read(map, "gyro_bias", &imu.gyro_bias);
  ReadNotNegative(map, "accel_bias_walk", &imu.accel_bias_walk);
  ReadNotNegative(map, "gyro_bias_walk", &imu.gyro_bias_walk);
  Read(map, "misalignment", &imu.misalignment);
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
  const std::string kind =
      map.GetChoice("kind", {"complementary_filter", "drifting_error", "constant_error"},
                    "complementary_filter");
  ReadNotNegative(map, "rate", &ahrs.rate);
  if (kind == "complementary_filter") {
    ReadPositive(map, "tilt_gain", &ahrs.tilt_gain);
    ReadNotNegative(map, "integral_gain", &ahrs.integral_gain);
    ReadNotNegative(map, "heading_gain", &ahrs.heading_gain);
    Read(map, "heading_error", &ahrs.heading_error);
  } else {
    ahrs.kind = AhrsKind::kConstantError;
    Read(map, "constant", &ahrs.constant);
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

void ReadFixNoise(const YamlMap& map, DetectorConfig* detector) {
  ReadNotNegative(map, "sigma_factor", &detector->sigma_factor);
  ReadPositive(map, "sigma_floor", &detector->sigma_floor);
  ReadNotNegative(map, "outlier_share", &detector->outlier_share);
  if (detector->outlier_share > 1.0) map.Fail("outlier_share", "is a share: 0 to 1");
  ReadPositive(map, "outlier_size", &detector->outlier_size);
  ReadNotNegative(map, "tail_dof", &detector->tail_dof);
  Read(map, "latency", &detector->latency);
  ReadNotNegative(map, "jitter", &detector->jitter);
}

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
  Read(map, "camera_pitch_deg", &detector.camera_pitch_deg);
  ReadPositive(map, "max_view_deg", &detector.max_view_deg);
  ReadFixNoise(map, &detector);
  detector.turned_by_ahrs = map.GetChoice("turned_by", {"truth", "ahrs"}, "truth") == "ahrs";
  map.Finish();
  return detector;
}

// The small streams: rate and noise.
void ReadStreams(const YamlMap& map, SimulationConfig* config) {
  const YamlMap mocap = map.ChildOrEmpty("mocap");
  ReadNotNegative(mocap, "rate", &config->mocap.rate);
  ReadNotNegative(mocap, "position_sigma", &config->mocap.position_sigma);
  ReadNotNegative(mocap, "attitude_sigma", &config->mocap.attitude_sigma);
  mocap.Finish();
  const YamlMap rotors = map.ChildOrEmpty("rotors");
  ReadNotNegative(rotors, "rate", &config->rotors.rate);
  ReadNotNegative(rotors, "sigma", &config->rotors.sigma);
  rotors.Finish();
  const YamlMap range = map.ChildOrEmpty("range");
  ReadNotNegative(range, "rate", &config->range.rate);
  ReadNotNegative(range, "sigma", &config->range.sigma);
  range.Finish();
}

EffectSetting ReadEffect(const YamlMap& map) {
  EffectSetting effect;
  effect.id = map.Get<std::string>("id");
  const EffectDefinition* definition = FindEffect(effect.id);
  if (definition == nullptr) {
    map.Fail("id", fmt::format("unknown effect '{}'; use one of: {}", effect.id,
                               fmt::join(EffectIds(), ", ")));
  }
  for (const EffectParameter& parameter : definition->parameters) {
    effect.values[parameter.name] = parameter.fallback
                                        ? map.Get<double>(parameter.name, *parameter.fallback)
                                        : map.Get<double>(parameter.name);
  }
  map.Finish();
  return effect;
}

void ReadRandomise(const YamlMap& map, SimulationConfig* config) {
  const std::vector<std::string> known = TunableNames(*config);
  for (const std::string& key : map.Keys()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      map.Fail(key, fmt::format("can't be drawn at random; use one of: {}",
                                fmt::join(known, ", ")));
    }
    const auto range = map.Get<std::vector<double>>(key);
    if (range.size() != 2 || range[1] < range[0]) map.Fail(key, "needs a range [low, high]");
    config->randomise[key] = {range[0], range[1]};
  }
}

}  // namespace
}  // namespace simulation

SimulationConfig ReadSimulationConfig(const YamlMap& map) {
  using namespace simulation;  // NOLINT(google-build-using-namespace): its own internals
  SimulationConfig config;
  config.name = map.Get<std::string>("name", config.name);
  ReadPositive(map, "duration", &config.duration);
  ReadNotNegative(map, "warm_up", &config.warm_up);
  ReadPositive(map, "gravity", &config.gravity);
  config.course = ReadCourse(map.Child("course"));
  config.vehicle = ReadVehicle(map.ChildOrEmpty("vehicle"), config.gravity);
  config.autopilot = ReadAutopilot(map.ChildOrEmpty("autopilot"));
  config.turbulence = ReadTurbulence(map.ChildOrEmpty("turbulence"));
  config.imu = ReadImu(map.ChildOrEmpty("imu"));
  config.ahrs = ReadAhrs(map.ChildOrEmpty("ahrs"));
  config.detector = ReadDetector(map.ChildOrEmpty("detector"));
  ReadStreams(map, &config);
  for (const YamlMap& effect : map.Children("effects")) {
    config.effects.push_back(ReadEffect(effect));
  }
  ReadRandomise(map.ChildOrEmpty("randomise"), &config);
  map.Finish();
  return config;
}

}  // namespace trueline
