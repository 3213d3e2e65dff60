#include "problems/simulation/rotor_flight_config.h"

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
  const std::string warning =
      LimitWarning(map.file(), RotorFlight(simulation.vehicle, path), simulation.limits);
  return {simulation, path, warning};
}

}  // namespace trueline
