// Terms of the open catalogue that the simulator flies: names are those of model.yaml
// (problems/effects/term.h), the physics is the simulator's own.
//
//   forces:
//     - {id: term, where: force_x, with: q*v_x, size: 0.1, unit: m/s^2 for each rad/s m/s}
#pragma once

#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/effects/effect.h"
#include "problems/simulation/effects.h"

namespace trueline::simulation {

// Throws InputError for a term that is not known, or that cannot be flown: an error of a sensor,
// and what goes with the battery's voltage.
Effect ReadFlownTerm(const YamlMap& entry);

// Forces and angular accelerations, computed at every step of the integration.
void AddTerms(const std::vector<Effect>& terms, Stages* stages);

}  // namespace trueline::simulation
