#include "problems/simulation/flown.h"

#include <cmath>

namespace trueline {

Flown Fly(const RotorSimulation& simulation, const PiecewisePolynomial& path, std::uint64_t seed) {
  Flown flown;
  flown.log = SimulateRotorFlight(simulation, path, seed, &flown.truth);
  flown.data = MakeRotorData(flown.log, simulation.vehicle.model.num_rotors(), {});
  for (const RotorPose& pose : flown.data.poses) {
    flown.nodes.push_back(flown.truth.states[std::lround(pose.t * simulation.imu_rate)]);
  }
  return flown;
}

RotorAeroModel ModelOf(const RotorSimulation& simulation) {
  const RotorDrivenModel& model = simulation.vehicle.model;
  return RotorAeroModel(model.rotors(), model.gravity());
}

}  // namespace trueline
