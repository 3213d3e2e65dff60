// The truth file beside a simulated log, for scoring.
#pragma once

#include <filesystem>
#include <string>

#include "problems/simulation/simulate.h"
#include "problems/simulation/simulate_rotor_flight.h"

namespace trueline {

// YAML: the parameters of eq. 16 with value, unit and whether they are constant over the flight,
// the AHRS's error, the effects and forces, statistics of the flight, seed, version, configuration.
std::string TruthYaml(const SimulationTruth& truth, const std::string& config_file);

// The true constants of a rotor-driven flight with units, drag and lag, effects and forces, seed,
// version, configuration.
std::string TruthYaml(const RotorTruth& truth, const RotorSimulation& simulation,
                      std::uint64_t seed, const std::string& config_file);

// DIR.truth.yaml beside the log's directory, never inside it.
std::filesystem::path TruthPath(const std::filesystem::path& log_directory);

}  // namespace trueline
