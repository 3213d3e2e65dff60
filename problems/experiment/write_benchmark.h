// The result files of trueline-benchmark, and its table. Except for solve times they depend on the
// experiment only, and neither on the number of threads nor on resuming.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/experiment/job.h"
#include "problems/result/statistics.h"

namespace trueline {

// Figures of a benchmark: for each flight source, label, gamma and sweep value, over all seeds.

struct GroupLabel {
  std::string log, label;
  int gamma = 0;
  int sweep_index = 0;
  double x = 0.0;  // NaN: no sweep
  int flights = 0;
};

struct GroupSummary : GroupLabel {
  std::string estimator;
  int diverged = 0;  // arcs whose error is not a finite number; not part of the figures below
  ErrorSummary error = {};                                           // final-point error, m
  double rms = 0.0;                                                  // of it, m
  std::optional<Interval> mean_interval = {}, median_interval = {};  // 95 %, bootstrap over flights
  int inside_95 = 0;  // arcs inside their 95 % ellipse
  double iterations_mean = 0.0;
  int iterations_max = 0;
  double bound_rms = 0.0;  // m, to be compared with rms; NaN: not asked for
};

struct ConvergenceSummary : GroupLabel {
  std::string quantity;
  double tolerance = 0.0;
  int converged = 0;         // flights on which the quantity came to stay inside
  double median_time = 0.0;  // s from the first fix; infinite where fewer than half converged
  std::optional<Interval> interval = {};
};

struct ForecastSummary : GroupLabel {
  double horizon = 0.0;  // s
  int count = 0;
  double median_error = 0.0;                          // m
  std::array<int, kRegionLevels.size()> inside = {};  // forecasts inside the region of each level
};

// In the order in which they first occur in the jobs.
std::vector<GroupSummary> SummariseGroups(const std::vector<JobOutcome>& outcomes);
std::vector<ForecastSummary> SummariseForecasts(const std::vector<JobOutcome>& outcomes);
std::vector<ConvergenceSummary> SummariseConvergence(const std::vector<JobOutcome>& outcomes);

// arcs.csv (that of trueline-calibrate with the columns label, sweep, seed, bound ... added),
// summary.yaml, timing.yaml with the wall time, and if the experiment asks for them
// convergence.csv, starts.csv, trajectory.csv. With `times` false the column solve_time is empty,
// so that arcs.csv has the same bytes in every run.
void WriteBenchmark(const Experiment& experiment, const ExperimentRun& run, int threads, bool times,
                    const std::filesystem::path& directory);

// summary.yaml: groups, convergence, starts, failures, provenance. Independent of times and
// threads.
std::string SummaryYaml(const Experiment& experiment, const ExperimentRun& run);

// For standard output.
std::string BenchmarkTable(const Experiment& experiment, const ExperimentRun& run);
// The mean errors, and the median times of convergence, a column a log.
std::string BenchmarkBrief(const ExperimentRun& run);

// The result files of an experiment with rotor-driven flights.

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
