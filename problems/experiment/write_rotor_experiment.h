// The result files of an experiment with rotor-driven flights.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/experiment/job.h"

namespace trueline {

// Statistics of the trials by kind of flight: errors, sigmas, coverage and bounds.

// One constant, or a group of three axes. A group such as r_BP uses the length of the error vector,
// as the paper's RMSE does; its sigma and bound are roots of summed variances, its coverage counts
// all axes.
struct EstimatorScore {
  double rmse = 0.0;
  double mean_error = 0.0;  // constants only
  double sigma = 0.0;       // root of the mean variance stated
  double coverage = 0.0;    // share of errors within 1.96 sigma
  int diverged = 0;         // flights without an estimate, which do not count
};

struct ConstantScore {
  std::string name;  // m, I_x, ..., or a group: I, r_BM, r_BP, r_BI, b_a, b_w
  std::string unit;
  EstimatorScore filter, ordinary, batch;
  double bound = 0.0;        // root of the mean Cramer-Rao variance
  double first_guess = 0.0;  // its RMS error
};

struct KindSummary {
  std::string name;
  int flights = 0, failures = 0;
  std::vector<ConstantScore> constants, groups;
  double filter_nees = 0.0, batch_nees = 0.0;  // mean for each degree of freedom; 1 if consistent
  double filter_nees_median = 0.0, batch_nees_median = 0.0;
  double batch_over_bound = 0.0;  // root mean over constants of squared error over squared bound
  double filter_over_bound = 0.0;
  double path_error = 0.0;  // m, RMS
};

std::vector<KindSummary> SummariseTrials(const RotorExperiment& experiment,
                                         const std::vector<JobOutcome>& outcomes);

// The trials of one kind of flight that have a result.
std::vector<const TrialRow*> TrialsOf(const std::vector<JobOutcome>& outcomes,
                                      const std::string& kind);

// summary.yaml; trials.csv (each constant of each flight); history.csv (the filter's errors over
// time by kind: mean, spread between flights, RMSE, stated sigma); trajectory_KIND.yaml of each
// trajectory chosen by the experiment, with '_' for blanks in the name.
void WriteRotorExperiment(const RotorExperiment& experiment, const ExperimentRun& run,
                          const std::filesystem::path& directory);

// For standard output: each constant of each kind; of each kind a line, by the batch.
std::string RotorExperimentTable(const RotorExperiment& experiment, const ExperimentRun& run);
std::string RotorExperimentBrief(const RotorExperiment& experiment, const ExperimentRun& run);

}  // namespace trueline
