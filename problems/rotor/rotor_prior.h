// The prior on a vehicle's constants: nominal values with standard deviations.
#pragma once

#include <vector>

#include "problems/rotor/rotor_state.h"
#include "problems/rotor/rotor_vehicle.h"

namespace trueline {

struct RotorPrior {
  RotorConstants mean = RotorConstants::Zero();
  RotorConstants sigma = RotorConstants::Zero();  // zero: known, not estimated

  std::vector<int> Free() const;
  // True if the constant of this name is unknown; false for an empty name.
  bool Estimates(const std::string& name) const;
  // `constants` with the known ones at their values.
  RotorConstants WithKnown(const RotorConstants& constants) const;
};

// Means at the vehicle's nominal values, and sigmas for a new payload (kRotorConstants). The 18
// constants of Wuest et al. 2019 are free. All others are known: r_BI_z, k_f and k_m at the
// vehicle's values, those beyond Boehm et al. 2020 at zero.
RotorPrior PriorFromVehicle(const RotorVehicle& vehicle);

// `map` holds NAME: sigma, or NAME: {mean: ..., sigma: ...}; sigma 0 makes a constant known. Throws
// InputError for unknown names and lists the known ones.
void ReadRotorPrior(const YamlMap& map, RotorPrior* prior);
YAML::Node ToYaml(const RotorPrior& prior);

}  // namespace trueline
