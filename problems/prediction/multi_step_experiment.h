// Multi-step prediction of measured flight, by the protocol of the NanoDrone benchmark (Busetto et
// al. 2026): from the state at one row and the rotor speeds of 50 rows, the next 50 states.
//
//   kind: multi_step            # name, about, vehicle and numbers: prediction_experiment.h
//   processes: {level: {length_s: 0.36, ...}, heading: {...}, learn: true}
//   windows: 600                # of each trajectory, for the fit
//   drag: 0.42                  # 1/s, of the second physics baseline
//   predictions_stride: 1       # predictions.csv holds every such start row
//   published: [{name: ..., average: concatenated, sums: [p, v, R, w]}]   # for the page
//
// Without a test folder every trajectory is predicted by a fit to the others; with one, its
// trajectories by one fit to all of the training folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cost_functions/models/stabilised_process.h"
#include "problems/common/yaml_archive.h"
#include "problems/prediction/multi_step_score.h"
#include "problems/prediction/prediction_experiment.h"
#include "problems/prediction/tube.h"

namespace trueline {

void Serialize(YamlArchive* a, StabilisedProcessNumbers* numbers);

struct PublishedScore {
  std::string name, average;
  std::vector<double> sums;                                     // over all steps: p, v, R, w
  std::vector<std::pair<std::string, std::vector<double>>> at;  // the same at h1, h10, h50
};

struct MultiStepExperiment : PredictionExperiment {
  PredictionSetup setup;
  double drag = 0.42;  // 1/s
  int predictions_stride = 1;
  std::vector<PublishedScore> published;
};

MultiStepExperiment ReadMultiStepExperiment(const std::filesystem::path& file);
// A trial: few windows, one round.
void ShortenMultiStepExperiment(MultiStepExperiment* experiment);

struct MultiStepRow {
  std::string trajectory, predictor;
  MultiStepScore score;
};

// The share of a trajectory's windows that the tubes hold.
struct TubeRow {
  std::string trajectory;
  TubeShares held;
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
  std::vector<TubeRow> tubes;
  std::vector<PredictionRun> predicted;  // the runs that were predicted

  // The fit that predicted a trajectory.
  const PredictionFit& FitFor(const std::string& trajectory) const;
};

// Throws InputError where a folder holds no runs, or too few trajectories to leave one out.
// `test` may be empty.
MultiStepResult RunMultiStepExperiment(const MultiStepExperiment& experiment,
                                       const std::filesystem::path& training,
                                       const std::filesystem::path& test, int threads, bool quiet);

// summary.yaml (scores of both averages, the fitted numbers with sigma and unit, each fold's),
// horizons.csv (mean errors at every horizon), and model.yaml (what the fit to all says of forces).
void WriteMultiStep(const MultiStepExperiment& experiment, const MultiStepResult& result,
                    const std::filesystem::path& directory);

// predictions.csv: the fitted model's states at every step from the start rows, a line a
// step, and the radii of their tubes, which follow the run (tube.h). Frames as PredictionRun; the
// quaternion goes on from the start's without taking the shorter way.
void WritePredictions(const MultiStepExperiment& experiment, const MultiStepResult& result,
                      int threads, const std::filesystem::path& directory);

// For standard output.
std::string MultiStepBrief(const MultiStepResult& result);  // without the fitted numbers
std::string MultiStepTable(const MultiStepExperiment& experiment, const MultiStepResult& result);

}  // namespace trueline
