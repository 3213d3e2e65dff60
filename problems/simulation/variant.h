// Variants of a configuration for Monte-Carlo: true parameters drawn from the ranges of its
// `randomise:` section.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "problems/simulation/config.h"

namespace trueline {

// The configuration with each parameter of `randomise` drawn uniformly from its range. Each draw
// depends on the seed and the parameter's name only.
SimulationConfig DrawVariant(const SimulationConfig& config, std::uint64_t seed);

// Replaces the configuration's vehicle by that of a model.yaml (trueline-calibrate,
// trueline-diagnose): drag, thrust bias, misalignment, and its effects.
SimulationConfig WithModel(const SimulationConfig& config, const YamlMap& model);

// The parameters that `randomise` accepts, with their values: K_x, b_az, phi_I_B, ... and
// `effect.parameter` for the configured effects.
std::map<std::string, double> TunableValues(const SimulationConfig& config);

}  // namespace trueline
