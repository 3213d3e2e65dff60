// A simulated flight: the estimators' inputs and the truth that scores them.
#pragma once

#include <cstdint>
#include <vector>

#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/simulation/simulate_rotor_flight.h"

namespace trueline {

struct Flown {
  FlightLog log;
  RotorTruth truth;
  RotorData data;
  std::vector<RotorNode> nodes;  // the truth at each pose
};

// Throws InputError if the vehicle departs from the trajectory.
Flown Fly(const RotorSimulation& simulation, const PiecewisePolynomial& path, std::uint64_t seed);

// The estimators' model: without the simulation's additional effects.
RotorAeroModel ModelOf(const RotorSimulation& simulation);

// A first guess, drawn from `prior` about the true constants and limited to physical bodies.
// Constants that the prior states as known keep its values.
RotorPrior DrawGuess(const RotorPrior& prior, const RotorConstants& truth, std::uint64_t seed);

}  // namespace trueline
