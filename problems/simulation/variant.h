// Variants of a configuration for Monte-Carlo: true parameters drawn from the ranges of its
// `randomise:` section.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "problems/simulation/config.h"
#include "problems/simulation/effects.h"

namespace trueline {

// The configuration with each parameter of `randomise` drawn uniformly from its range. Each draw
// depends on the seed and the parameter's name only. Throws InputError for a parameter that acts on
// nothing in this flight, or for a drawn value that means nothing.
SimulationConfig DrawVariant(const SimulationConfig& config, std::uint64_t seed);

// What the configured flight has for effects to act on.
simulation::Actors ActorsOf(const SimulationConfig& config);

// Replaces the configuration's vehicle by that of a model.yaml (trueline-calibrate,
// trueline-diagnose): drag, thrust bias, misalignment, and its effects.
SimulationConfig WithModel(const SimulationConfig& config, const YamlMap& model);

// The parameters that `randomise` accepts, with their values: K_x, b_az, phi_I_B, ... and
// `effect.parameter` for the configured effects.
std::map<std::string, double> TunableValues(const SimulationConfig& config);

}  // namespace trueline
