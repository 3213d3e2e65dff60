// A rotor-driven flight from its YAML (config/rotors/): vehicle, trajectory, sensors, effects.
#pragma once

#include "problems/simulation/simulate_rotor_flight.h"

namespace trueline {

struct RotorFlightConfig {
  RotorSimulation simulation;
  PiecewisePolynomial path;
  std::string warning;  // of a path that the vehicle can't follow within its limits; else empty
};

// True if a configuration of trueline-simulate has `trajectory`: it asks for such a flight.
bool IsRotorFlight(const YamlMap& map);
// Keys gravity, vehicle, biases, limits, simulation and trajectory (as trueline-observe). Throws
// InputError naming file, line and key.
RotorFlightConfig ReadRotorFlight(const YamlMap& map);

// Reads gravity, vehicle, biases, limits and simulation; the caller reads the other keys.
RotorSimulation ReadRotorFlightVehicle(const YamlMap& map);

}  // namespace trueline
