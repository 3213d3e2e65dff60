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

// Without `seconds` as long as it ships.
inline SimulationConfig ReadShipped(const std::string& name, double seconds = 0.0,
                                    const std::vector<Effect>& effects = {}) {
  SimulationConfig config =
      ReadSimulationConfig(YamlMap::FromFile(ConfigFolder() / (name + ".yaml")));
  if (seconds > 0.0) config.duration = seconds;
  if (!effects.empty()) config.effects = effects;
  return config;
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

inline FlightLog LogOf(const std::string& name, double seconds, std::uint64_t seed,
                       const std::vector<Effect>& effects = {}) {
  return Fly(ReadShipped(name, seconds, effects), seed).log;
}

inline Flown FlyWith(const std::string& id, const std::map<std::string, double>& values) {
  SimulationConfig config = ShortExactFlight();
  config.effects = {{id, values}};
  return Fly(config);
}

}  // namespace trueline::testing_simulation
