#include "problems/log/log_yaml.h"

#include <fmt/format.h>

#include <set>

#include "problems/common/error.h"

namespace trueline {
namespace {

void RequireFrame(const YamlMap& map, const std::string& key, const std::string& wanted) {
  const std::string found = map.Get<std::string>(key);
  if (found != wanted) {
    map.Fail(key,
             fmt::format("found '{}'; a native log is {} (trueline convert turns other frames)",
                         found, wanted));
  }
}

double Positive(const YamlMap& map, const std::string& key, double value) {
  if (!(value > 0.0)) map.Fail(key, fmt::format("found {}; must be positive", value));
  return value;
}

std::map<std::string, std::string> ReadSource(const YamlMap& map) {
  std::map<std::string, std::string> source;
  for (const std::string& key : map.Keys()) source[key] = map.Get<std::string>(key);
  return source;
}

// A number that reads back as the same double; YAML's own emitter would round it.
std::string Number(double value) { return fmt::format("{}", value); }

void EmitVector(const Eigen::Vector3d& vector, YAML::Emitter* out) {
  *out << YAML::Flow << YAML::BeginSeq;
  for (const double value : vector) *out << Number(value);
  *out << YAML::EndSeq;
}

void EmitGates(const std::vector<Gate>& gates, YAML::Emitter* out) {
  *out << YAML::Key << "gates" << YAML::Value << YAML::BeginSeq;
  for (const Gate& gate : gates) {
    *out << YAML::Flow << YAML::BeginMap << YAML::Key << "id" << YAML::Value << gate.id;
    *out << YAML::Key << "position" << YAML::Value;
    EmitVector(gate.position, out);
    *out << YAML::Key << "yaw" << YAML::Value << Number(gate.yaw) << YAML::EndMap;
  }
  *out << YAML::EndSeq;
}

void EmitRotor(const Rotor& rotor, YAML::Emitter* out) {
  *out << YAML::Flow << YAML::BeginMap << YAML::Key << "position" << YAML::Value;
  EmitVector(rotor.position, out);
  *out << YAML::Key << "axis" << YAML::Value;
  EmitVector(rotor.axis, out);
  *out << YAML::Key << "spin" << YAML::Value << rotor.spin;
  *out << YAML::Key << "k_f" << YAML::Value << Number(rotor.k_f);
  *out << YAML::Key << "k_m" << YAML::Value << Number(rotor.k_m) << YAML::EndMap;
}

void EmitVehicle(const Vehicle& vehicle, YAML::Emitter* out) {
  *out << YAML::Key << "vehicle" << YAML::Value << YAML::BeginMap;
  if (vehicle.mass) *out << YAML::Key << "mass" << YAML::Value << Number(*vehicle.mass);
  if (!vehicle.rotors.empty()) {
    *out << YAML::Key << "rotors" << YAML::Value << YAML::BeginSeq;
    for (const Rotor& rotor : vehicle.rotors) EmitRotor(rotor, out);
    *out << YAML::EndSeq;
  }
  *out << YAML::EndMap;
}

}  // namespace

Vehicle ReadVehicle(const YamlMap& map) {
  Vehicle vehicle;
  vehicle.mass = map.GetOptional<double>("mass");
  if (vehicle.mass) Positive(map, "mass", *vehicle.mass);
  vehicle.rotors = ReadRotors(map.Children("rotors"));
  map.Finish();
  return vehicle;
}

std::vector<Gate> ReadGates(const YamlMap& parent) {
  std::vector<Gate> gates;
  std::set<int> ids;
  for (const YamlMap& map : parent.Children("gates")) {
    Gate gate{map.Get<int>("id"), map.GetVector3("position"), map.Get<double>("yaw", 0.0)};
    map.Finish();
    if (gate.id < 0) map.Fail("id", "must be 0 or more; give the gate and its fixes another id");
    if (!ids.insert(gate.id).second) {
      map.Fail("id",
               fmt::format("gate {} occurs twice; give every gate an id of its own", gate.id));
    }
    gates.push_back(gate);
  }
  return gates;
}

std::string ReadEnvironment(const YamlMap& map) {
  if (!map.GetOptional<std::string>("environment")) return "";
  return map.GetChoice("environment", {"indoors", "outdoors"}, "");
}

// A gravity that no place on the Earth has is mostly a typing error, or a number that was cut off.
void WarnOfGravity(FlightLog* log) {
  constexpr double kLeast = 9.76, kMost = 9.84;  // m/s^2, with 0.004 to spare
  if (log->gravity > kLeast && log->gravity < kMost) return;
  log->warnings.push_back(fmt::format(
      "log.yaml: gravity is {:g} m/s^2, on the Earth it is between {:.2f} and {:.2f}; b_az and "
      "thrust take the difference. If this isn't meant, correct `gravity`",
      log->gravity, kLeast, kMost));
}

void ReadLogYaml(const std::filesystem::path& path, FlightLog* log) {
  const YamlMap map = YamlMap::FromFile(path);
  log->name = map.Get<std::string>("name", "");
  RequireFrame(map, "frame", "NED");
  RequireFrame(map, "body", "FRD");
  log->gravity = Positive(map, "gravity", map.Get<double>("gravity", 9.81));
  WarnOfGravity(log);
  log->environment = ReadEnvironment(map);
  log->gates = ReadGates(map);
  const YamlMap vehicle = map.ChildOrEmpty("vehicle");
  if (map.Has("vehicle")) log->vehicle = ReadVehicle(vehicle);
  log->source = ReadSource(map.ChildOrEmpty("source"));
  map.Finish();
}

std::string LogYaml(const FlightLog& log) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "name" << YAML::Value << log.name;
  out << YAML::Key << "frame" << YAML::Value << "NED" << YAML::Key << "body" << YAML::Value
      << "FRD";
  out << YAML::Key << "gravity" << YAML::Value << Number(log.gravity);
  if (!log.environment.empty()) {
    out << YAML::Key << "environment" << YAML::Value << log.environment;
  }
  if (!log.gates.empty()) EmitGates(log.gates, &out);
  if (log.vehicle) EmitVehicle(*log.vehicle, &out);
  if (!log.source.empty()) out << YAML::Key << "source" << YAML::Value << log.source;
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

namespace {

Rotor ReadRotor(const YamlMap& map) {
  Rotor rotor;
  rotor.position = map.GetVector3("position");
  rotor.axis = map.GetVector3("axis", rotor.axis);
  if (!(rotor.axis.norm() > 0.0)) map.Fail("axis", "has no direction; give the axis of thrust");
  rotor.axis.normalize();
  rotor.spin = map.Get<int>("spin");
  if (rotor.spin != 1 && rotor.spin != -1) {
    map.Fail("spin", fmt::format("found {}; use 1 (clockwise from above) or -1", rotor.spin));
  }
  rotor.k_f = map.Get<double>("k_f");
  if (!(rotor.k_f > 0.0)) {
    map.Fail("k_f", fmt::format("found {}; must be positive, in N s^2", rotor.k_f));
  }
  rotor.k_m = map.Get<double>("k_m");
  if (!(rotor.k_m >= 0.0)) {
    map.Fail("k_m", fmt::format("found {}; must not be negative, in N m s^2: spin gives the sign",
                                rotor.k_m));
  }
  map.Finish();
  return rotor;
}

}  // namespace

std::vector<Rotor> ReadRotors(const std::vector<YamlMap>& rotors) {
  std::vector<Rotor> read;
  read.reserve(rotors.size());
  for (const YamlMap& map : rotors) read.push_back(ReadRotor(map));
  return read;
}

}  // namespace trueline
