#include "problems/simulation/flown.h"

#include <cmath>

#include "cost_functions/models/rigid_body.h"
#include "problems/common/random.h"

namespace trueline {

Flown Fly(const RotorSimulation& simulation, const PiecewisePolynomial& path, std::uint64_t seed) {
  Flown flown;
  flown.log = SimulateRotorFlight(simulation, path, seed, &flown.truth);
  flown.data = MakeRotorData(flown.log, simulation.vehicle.model.num_rotors(), {});
  for (const RotorPose& pose : flown.data.poses) {
    flown.nodes.push_back({flown.truth.states[std::lround(pose.t * simulation.imu_rate)]});
  }
  return flown;
}

RotorAeroModel ModelOf(const RotorSimulation& simulation) {
  const RotorDrivenModel& model = simulation.vehicle.model;
  return RotorAeroModel(model.rotors(), model.gravity());
}

RotorPrior DrawGuess(const RotorPrior& prior, const RotorConstants& truth, std::uint64_t seed) {
  RotorPrior drawn = prior;
  Random random(seed, "first guess");
  const int inertia = FindRotorConstant("I_x");
  do {
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      const double error = prior.sigma[i] * random.Normal();
      if (prior.sigma[i] > 0.0) drawn.mean[i] = truth[i] + error;
    }
  } while (!IsPhysicalInertia(drawn.mean.segment<3>(inertia)) ||
           !(drawn.mean[kMassConstant] > 0.0));
  return drawn;
}

}  // namespace trueline
