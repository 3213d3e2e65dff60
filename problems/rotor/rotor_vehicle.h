// A vehicle of the rotor-driven model, from YAML (config/observe/, config/design/) or from a log.
#pragma once

#include <string>
#include <vector>

#include "cost_functions/models/rotor_driven_model.h"
#include "problems/common/yaml_archive.h"
#include "problems/log/flight_log.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// A vehicle with its parameters as the model's kStates numbers, at rest and level.
struct RotorVehicle {
  RotorDrivenModel model;
  std::vector<double> parameters;
};

// Keys: mass, inertia [x, y, z], r_BM, r_BP, r_BI, rotors (as in a native log's vehicle). Throws
// InputError for an unphysical mass, inertia or rotor, naming the key.
RotorVehicle ReadRotorVehicle(const YamlMap& map, double gravity);

// A vehicle from the log's own section. A log does not state inertia and lever arms: inertia is
// guessed from mass and rotor positions (radius of gyration 0.4 of the mean rotor distance), lever
// arms are zero, and `warning` says so.
RotorVehicle VehicleFromLog(const FlightLog& log, std::string* warning);

// The prior on a vehicle's constants: nominal values with standard deviations.
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
