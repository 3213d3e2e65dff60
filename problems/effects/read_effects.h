// The effects of a model.yaml.
#pragma once

#include "problems/common/strict_yaml.h"
#include "problems/effects/effect.h"

namespace trueline {

// The list under `effects:`, each {id: ..., parameter: value, ...}. Throws InputError for an id
// that `known` rejects (by default: one that no estimator can correct for), and for values that are
// not finite numbers.
std::vector<Effect> ReadEffects(const YamlMap& model,
                                bool (*known)(const std::string& id) = IsModelled);

}  // namespace trueline
