// Forces that no effect of the catalogue states, for tests of the diagnosis: they go with how the
// vehicle moves, or act at a place.
//
//   forces:
//     - {along: x_B, goes_with: pitch rate, size: 0.5}      # m/s^2 for each rad/s
//     - {along: y_B, goes_with: yaw rate * forward speed, size: 0.1}
//     - {along: east, place: [8, 2], radius: 2, size: 1.5}  # m; half the size at the radius
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/effects/effect.h"
#include "problems/simulation/airframe.h"

namespace trueline::simulation {

// Throws InputError for an unknown axis or variable. Entries with an `id: term` are those of a
// model.yaml (flown_terms.h); they go to `terms`.
std::vector<UnnamedForce> ReadUnnamedForces(const YamlMap& map, std::vector<Effect>* terms);

// An entry of `forces`, as it is read.
YAML::Node ToYaml(const UnnamedForce& force);

// Specific force on the vehicle in E, m/s^2.
Vector3d ForceOf(const std::vector<UnnamedForce>& forces, const BodyState& state);

}  // namespace trueline::simulation
