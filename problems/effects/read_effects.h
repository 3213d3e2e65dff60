// The effects of a model.yaml.
#pragma once

#include "problems/common/strict_yaml.h"
#include "problems/effects/declaration.h"

namespace trueline {

// The list under `effects:`, each {id: ..., parameter: value, ...}. Throws InputError for an id
// that is not declared for the drive, for parameters that are left out or misspelt, and for values
// that are not finite numbers. A term of the open catalogue is {id: term, where: force_x, with: q,
// size: 0.3, unit: m/s^2 for each rad/s}; unknown symbols and another unit are errors.
std::vector<Effect> ReadEffects(const YamlMap& model, DriveKind drive = DriveKind::kImu);

// A term among them; whether a model takes it is for the caller.
Effect ReadTerm(const YamlMap& entry);
// An entry of that list.
YAML::Node ToYaml(const Effect& effect);
// That list; [] if it is empty.
YAML::Node EffectsNode(const std::vector<Effect>& effects);

}  // namespace trueline
