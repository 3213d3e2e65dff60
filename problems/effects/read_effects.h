// The effects of a model.yaml.
#pragma once

#include "problems/common/strict_yaml.h"
#include "problems/effects/declaration.h"

namespace trueline {

// The list under `effects:`, each {id: ..., parameter: value, ...}. Throws InputError for an id
// that is not declared for the drive, for parameters that are left out or misspelt, and for values
// that are not finite numbers.
std::vector<Effect> ReadEffects(const YamlMap& model, DriveKind drive = DriveKind::kImu);

}  // namespace trueline
