// A simulated flight with what its estimators are given and what they are judged by.
#pragma once

#include <cstdint>
#include <vector>

#include "problems/rotor_data/rotor_data.h"
#include "problems/rotor_simulation/simulate_rotor_flight.h"

namespace trueline {

struct Flown {
  FlightLog log;
  RotorTruth truth;
  RotorData data;
  std::vector<RotorNode> nodes;  // the truth at each pose
};

// Throws InputError where the vehicle loses the trajectory.
Flown Fly(const RotorSimulation& simulation, const PiecewisePolynomial& path, std::uint64_t seed);

// What the estimators believe: none of the simulation's further effects.
RotorAeroModel ModelOf(const RotorSimulation& simulation);

}  // namespace trueline
