// Short flights for tests, and the file that they come from.
#pragma once

#include <filesystem>
#include <string>

#include "problems/simulation/rotation.h"
#include "problems/simulation/simulate.h"

namespace trueline::testing_simulation {

inline std::filesystem::path ConfigFolder() {
  return std::filesystem::path(TRUELINE_TEST_SOURCE_DIR) / "config/simulate";
}

inline SimulationConfig ReadShipped(const std::string& name) {
  return ReadSimulationConfig(YamlMap::FromFile(ConfigFolder() / (name + ".yaml")));
}

// The exact hippodrome, without noise in the fixes, 12 s after 5 s of settling.
inline SimulationConfig ShortExactFlight() {
  SimulationConfig config = ReadShipped("hippodrome_exact");
  config.duration = 12.0;
  config.warm_up = 5.0;
  config.detector.sigma_factor = 0.0;
  config.detector.sigma_floor = 1e-9;
  return config;
}

struct Flown {
  FlightLog log;
  SimulationTruth truth;
};

inline Flown Fly(const SimulationConfig& config, std::uint64_t seed = 1) {
  Flown flown;
  flown.log = Simulate(config, seed, &flown.truth);
  return flown;
}

// The log of `seconds` of a flight that ships.
inline FlightLog LogOf(const std::string& name, double seconds, std::uint64_t seed) {
  SimulationConfig config = ReadShipped(name);
  config.duration = seconds;
  return Fly(config, seed).log;
}

inline Flown FlyWith(const std::string& id, const std::map<std::string, double>& values) {
  SimulationConfig config = ShortExactFlight();
  config.effects = {{id, values}};
  return Fly(config);
}

}  // namespace trueline::testing_simulation
