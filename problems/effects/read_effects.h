// The effects of a model.yaml.
#pragma once

#include "problems/common/strict_yaml.h"
#include "problems/effects/effect.h"

namespace trueline {

// The list under `effects:`, each {id: ..., parameter: value, ...}. Throws InputError for an id
// that `known` does not know (by default: what no estimator can take out of a log), and for values
// that are not finite numbers.
std::vector<Effect> ReadEffects(const YamlMap& model,
                                bool (*known)(const std::string& id) = IsModelled);

}  // namespace trueline
