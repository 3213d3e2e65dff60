// What the experiments with the rotor-by-rotor model share: their head in YAML, the vehicle, the
// numbers, and how results name them.
//
//   kind: multi_step            # or wrench
//   name: ...; about: ...
//   vehicle: {mass: kg, radius: m, air_density: kg/m^3, rotors: [{position: [x, y, z], spin: 1}]}
//   numbers:                    # RotorAir's, then the experiment's; `free` ones are fitted
//     C_T: {start: 0.017, free: true}    # `typical`, the solver's unit: |start| where left out
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/prediction/fit_prediction.h"

namespace trueline {

// `kind` of an experiment's file; empty if it states none.
std::string ExperimentKind(const std::filesystem::path& file);

// What an experiment was run on, for provenance.
struct PredictionInputs {
  std::filesystem::path data, test;  // folders; `test` may be empty
  bool shortened = false;            // a trial, with fewer windows or rows
};

struct PredictionExperiment {
  std::string file, kind, name, about;
  YAML::Node config;  // for provenance
  PredictionInputs inputs;
};

// Reads kind, name and about; `map` is that of `file`. Another kind than `kind` is an error.
void ReadHead(const std::filesystem::path& file, const std::string& kind, const YamlMap& map,
              PredictionExperiment* experiment);
// Name, about, kind and provenance of a result.
YAML::Node HeadNode(const PredictionExperiment& experiment);

// Throws InputError unless there are four rotors.
RotorAirVehicle ReadRotorAirVehicle(const YamlMap& map);

using NumberInfo = const RotorAirInfo& (*)(int i);
std::vector<PredictionNumber> ReadNumbers(const YamlMap& map, int count, NumberInfo info);

// Values and sigmas by name with unit, status and meaning; `digits` of the values.
YAML::Node NumbersNode(const std::vector<PredictionNumber>& numbers,
                       const std::vector<double>& values, const std::vector<double>& sigmas,
                       NumberInfo info, int digits);
// A line for each fitted number.
std::string NumbersTable(const std::vector<PredictionNumber>& numbers,
                         const std::vector<double>& values, const std::vector<double>& sigmas,
                         NumberInfo info);

}  // namespace trueline
