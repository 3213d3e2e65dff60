// Variants of a configuration for Monte-Carlo: true parameters drawn from the ranges of its
// `randomise:` section.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "problems/simulation/config.h"

namespace trueline {

// The configuration with each parameter of `randomise` drawn uniformly from its range. A
// parameter's draw depends on the seed and its own name only.
SimulationConfig DrawVariant(const SimulationConfig& config, std::uint64_t seed);

// The vehicle of a model.yaml (trueline-calibrate, trueline-diagnose) in place of the
// configuration's: drag, thrust bias, misalignment, and its effects switched on.
SimulationConfig WithModel(const SimulationConfig& config, const YamlMap& model);

namespace simulation {

// What can be drawn: K_x, b_az, phi_I_B, ... and `effect.parameter` for the effects configured.
std::vector<std::string> TunableNames(const SimulationConfig& config);

}  // namespace simulation
}  // namespace trueline
