// YAML -> course, vehicle, autopilot, air.
#include <fmt/format.h>

#include "problems/log/log_yaml.h"
#include "problems/simulation/config_values.h"
#include "problems/simulation/course.h"

namespace trueline::simulation {

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

}  // namespace

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

}  // namespace

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

}  // namespace trueline::simulation
