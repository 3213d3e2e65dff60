#include "problems/rotor_simulation/rotor_flight_config.h"

#include "problems/common/app.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {

bool IsRotorFlight(const YamlMap& map) { return map.Has("trajectory"); }

RotorSimulation ReadRotorFlightVehicle(const YamlMap& map) {
  const double gravity = map.Get<double>("gravity", 9.81);
  RotorSimulation simulation(ReadRotorVehicle(map.Child("vehicle"), gravity));
  const YamlMap biases = map.ChildOrEmpty("biases");
  const Eigen::Vector3d accel = biases.GetVector3("accel", Eigen::Vector3d::Zero());
  const Eigen::Vector3d gyro = biases.GetVector3("gyro", Eigen::Vector3d::Zero());
  biases.Finish();
  for (int i = 0; i < 3; ++i) {
    simulation.vehicle.parameters[RotorDrivenModel::kAccelBias + i] = accel[i];
    simulation.vehicle.parameters[RotorDrivenModel::kGyroBias + i] = gyro[i];
  }
  simulation.limits = ReadLimits(map.ChildOrEmpty("limits"));
  ReadRotorSimulation(map.ChildOrEmpty("simulation"), &simulation);
  return simulation;
}

RotorFlightConfig ReadRotorFlight(const YamlMap& map) {
  const RotorSimulation simulation = ReadRotorFlightVehicle(map);
  PiecewisePolynomial path =
      ReadTrajectory(map.Child("trajectory"), simulation.vehicle, simulation.limits);
  map.Finish();
  return {simulation, path};
}

std::string RotorTruthYaml(const RotorTruth& truth, const RotorSimulation& config,
                           std::uint64_t seed, const std::string& config_file) {
  YAML::Node node;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    YAML::Node entry;
    entry["value"] = truth.constants[i];
    entry["unit"] = kRotorConstants[i].unit;
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node["parameters"][kRotorConstants[i].name] = entry;
  }
  for (int i = 0; i < 3; ++i) node["drag"].push_back(config.drag[i]);
  node["motor_lag"] = config.motor_lag;
  node["path_error_rms"] = truth.path_error_rms;
  node["seed"] = seed;
  node["version"] = Version();
  node["config"] = config_file;
  YAML::Emitter out;
  out.SetDoublePrecision(12);
  out << node;
  return std::string(out.c_str()) + "\n";
}

}  // namespace trueline
