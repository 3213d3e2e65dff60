// What the benchmarks of prediction share: their head in YAML, the vehicle, the numbers, and how
// results name them.
//
//   kind: multi_step            # or wrench
//   name: ...; about: ...
//   vehicle: {...}              # as in config/observe; its numbers are the starts
//   numbers:                    # constants of the rotor drive, and the experiment's own
//     k_f: {free: true}         # `start`; `typical`, the solver's unit: |start| where left out
//   effects: [...]              # as in model.yaml; sizes other than zero are fitted from there
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

// Throws InputError unless there are four rotors, and for an effect that is no force of known form.
// `numbers`: the experiment's own; those of FittedRotors follow them.
PredictedVehicle ReadPredictedVehicle(const YamlMap& map, std::vector<FittedNumber>* numbers);

// The content that `trueline calibrate --drive=rotors --model` takes: forces. The numbers of
// moments are left out: the rotors' moments mostly cancel disturbances, so that what predicts best
// is no inertia of the vehicle.
YAML::Node FittedModelNode(const PredictedVehicle& vehicle,
                           const std::vector<FittedNumber>& numbers,
                           const std::vector<double>& values, const std::vector<double>& sigmas,
                           const YAML::Node& provenance);
// Values and sigmas by name with unit, status and meaning; `digits` of the values. Those that are
// zero and held are left out.
YAML::Node NumbersNode(const std::vector<FittedNumber>& numbers, const std::vector<double>& values,
                       const std::vector<double>& sigmas, int digits);
// A line for each fitted number.
std::string NumbersTable(const std::vector<FittedNumber>& numbers,
                         const std::vector<double>& values, const std::vector<double>& sigmas);

}  // namespace trueline
