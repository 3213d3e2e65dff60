#pragma once

#include <vector>

#include "cost_functions/models/rotor.h"
#include "problems/common/strict_yaml.h"

namespace trueline {

// Reads position [m], axis (of any length; up if absent), spin, k_f [N s^2] and k_m [N m s^2] of
// each rotor. Throws InputError for what no rotor has.
std::vector<Rotor> ReadRotors(const std::vector<YamlMap>& rotors);

}  // namespace trueline
