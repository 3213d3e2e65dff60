// A vehicle of the rotor-driven model, from YAML (config/observe/, config/design/) or from a log.
#pragma once

#include <string>
#include <vector>

#include "cost_functions/models/rotor_driven_model.h"
#include "problems/common/yaml_archive.h"
#include "problems/log/flight_log.h"

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

}  // namespace trueline
