// One simulated flight of the vehicle of Wuest et al., for tests of filter and batch.
#pragma once

#include "problems/common/random.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "problems/trajectory/limits.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {

inline RotorVehicle WuestVehicle() { return {TestQuadrotor(), TestNominal()}; }

inline PiecewisePolynomial RandomPath(double duration, std::uint64_t seed) {
  SplineShape shape;
  shape.duration = duration;
  shape.pieces = std::max(10, static_cast<int>(2.0 * duration));
  Random random(seed, "trajectory");
  const RotorVehicle vehicle = WuestVehicle();
  return RandomFeasibleFlight(vehicle, shape, FlightLimits(), &random);
}

inline RotorAeroModel EstimationModel(const RotorVehicle& vehicle) {
  return RotorAeroModel(vehicle.model.rotors(), vehicle.model.gravity());
}

// The prior with its mean drawn at random around the truth.
inline RotorPrior DrawnPrior(const RotorVehicle& vehicle, std::uint64_t seed) {
  RotorPrior prior = PriorFromVehicle(vehicle);
  Random random(seed, "prior");
  RotorConstants mean;
  do {
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      mean[i] = prior.mean[i] + prior.sigma[i] * random.Normal();
    }
  } while (!IsPhysicalInertia(mean.segment<3>(1)) || mean[0] <= 0.0);
  prior.mean = mean;
  return prior;
}

}  // namespace trueline
