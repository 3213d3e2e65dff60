// A rotor-driven flight from its YAML (config/rotors/): vehicle, trajectory, sensors, effects.
#pragma once

#include <string>

#include "problems/rotor_simulation/simulate_rotor_flight.h"

namespace trueline {

struct RotorFlightConfig {
  RotorSimulation simulation;
  PiecewisePolynomial path;
};

// Whether a configuration of trueline-simulate asks for such a flight: it has a `trajectory`.
bool IsRotorFlight(const YamlMap& map);
// Keys gravity, vehicle, biases, limits, simulation and trajectory (as trueline-observe). Throws
// InputError naming file, line and key.
RotorFlightConfig ReadRotorFlight(const YamlMap& map);

// Its keys gravity, vehicle, biases, limits and simulation; the caller reads the rest.
RotorSimulation ReadRotorFlightVehicle(const YamlMap& map);

// The true constants with units, beside the log and never in it.
std::string RotorTruthYaml(const RotorTruth& truth, const RotorSimulation& config,
                           std::uint64_t seed, const std::string& config_file);

}  // namespace trueline
