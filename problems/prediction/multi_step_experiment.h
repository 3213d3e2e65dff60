// Multi-step prediction of measured flight, by the protocol of the NanoDrone benchmark (Busetto et
// al. 2026): from the state at one row and the rotor speeds of 50 rows, the next 50 states.
//
//   kind: multi_step
//   name: ...; about: ...
//   vehicle: {mass: kg, radius: m, air_density: kg/m^3, rotors: [{position: [x, y, z], spin: 1}]}
//   numbers:                    # RotorAir's and the state errors'; `free` ones are fitted
//     C_T: {start: 0.017, free: true}    # `typical`, the solver's unit: |start| where left out
//   processes: {level: {length: 0.36, ...}, heading: {...}, learn: true}
//   windows: 600                # of each trajectory, for the fit
//   drag: 0.42                  # 1/s, of the second physics baseline
//   published: [{name: ..., average: concatenated, sums: [p, v, R, w]}]   # for the page
//
// Without a test folder every trajectory is predicted by a fit to the others; with one, its
// trajectories by one fit to all of the training folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/prediction/fit_prediction.h"
#include "problems/prediction/multi_step_score.h"

namespace trueline {

struct PublishedScore {
  std::string name, average;
  std::vector<double> sums;  // p, v, R, w
};

struct MultiStepExperiment {
  std::string file, name, about;
  PredictionSetup setup;
  double drag = 0.42;  // 1/s
  std::vector<PublishedScore> published;
  YAML::Node config;  // for provenance
};

MultiStepExperiment ReadMultiStepExperiment(const std::filesystem::path& file);
// A trial: few windows, one round.
void ShortenMultiStepExperiment(MultiStepExperiment* experiment);

// `vehicle` and `numbers` of an experiment with this model; `info` names number i of `count`.
RotorAirVehicle ReadRotorAirVehicle(const YamlMap& map);
std::vector<PredictionNumber> ReadNumbers(const YamlMap& map, int count,
                                          const RotorAirInfo& (*info)(int i));

struct MultiStepRow {
  std::string trajectory, predictor;
  MultiStepScore score;
};

// One fit, and what it has predicted.
struct MultiStepFold {
  std::string trajectory;  // predicted
  std::vector<std::string> trained_on;
  PredictionFit fit;
};

struct MultiStepResult {
  std::vector<MultiStepFold> folds;
  PredictionFit fit;                    // to all training runs
  std::vector<std::string> trained_on;  // its trajectories
  std::vector<MultiStepRow> rows;
};

// Throws InputError where a folder holds no runs, or too few trajectories to leave one out.
// `test` may be empty.
MultiStepResult RunMultiStepExperiment(const MultiStepExperiment& experiment,
                                       const std::filesystem::path& training,
                                       const std::filesystem::path& test, int threads, bool quiet);

}  // namespace trueline
