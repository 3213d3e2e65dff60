// The prior on a vehicle's constants: nominal values with standard deviations.
#pragma once

#include <vector>

#include "problems/rotor_data/rotor_state.h"
#include "problems/rotor_data/rotor_vehicle.h"

namespace trueline {

struct RotorPrior {
  RotorConstants mean = RotorConstants::Zero();
  RotorConstants sigma = RotorConstants::Zero();  // zero: known, not estimated

  std::vector<int> Free() const;
};

// The 18 constants of Wuest et al. 2019 are free, with means at the vehicle's nominal values and
// sigmas for a new payload: mass 20 %, inertia 30 %, centre of mass 20 mm, pose sensor 50 mm, IMU
// 20 mm, biases 0.5 m/s^2 and 0.1 rad/s. r_BI_z, k_f and k_m are known; drag, inflow and delay are
// zero.
RotorPrior PriorFromVehicle(const RotorVehicle& vehicle);

// `map` holds NAME: sigma, or NAME: {mean: ..., sigma: ...}; sigma 0 makes a constant known. Throws
// InputError for unknown names and lists the known ones.
void ReadRotorPrior(const YamlMap& map, RotorPrior* prior);
YAML::Node ToYaml(const RotorPrior& prior);

}  // namespace trueline
