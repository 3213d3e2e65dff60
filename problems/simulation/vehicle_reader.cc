// YAML -> course, vehicle, autopilot, air.
#include "problems/simulation/config_values.h"
#include "problems/simulation/course.h"

namespace trueline::simulation {

namespace {

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

}  // namespace

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

namespace {

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

}  // namespace

VehicleConfig ReadVehicle(const YamlMap& map, double gravity) {
  VehicleConfig vehicle;
  ReadPositive(map, "mass", &vehicle.mass);
  ReadFinite(map, "inertia", &vehicle.inertia);
  if (vehicle.inertia.minCoeff() <= 0.0) map.Fail("inertia", "must be above 0 on each axis");
  ReadPositive(map, "motor_lag", &vehicle.motor_lag);
  ReadPositive(map, "max_rotor_speed", &vehicle.max_rotor_speed);
  ReadFinite(map, "drag", &vehicle.drag);
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

}  // namespace trueline::simulation
