// Designs a flight that shows chosen parameters well (Boehm et al. 2020, eq. 5): maximises the
// smallest singular value of the scaled, marginalised E2LOG Gramian within the flight's limits.
// Method: L-BFGS (Ceres) from several random starts on the logarithm of the score and a penalty on
// the limits that increases from round to round. Remaining violations are removed by shrinking the
// flight.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/observability/bound_design.h"
#include "problems/observability/column_scale.h"
#include "problems/observability/design_score.h"
#include "problems/trajectory/limits.h"

namespace trueline {

struct DesignOptions {
  SplineShape shape;
  FlightLimits limits;
  int candidates = 80;        // random flights and figures in turn, of which the best are starts
  bool random_only = false;   // candidates are random flights alone, as published
  int starts = 2;             // optimised, each on a thread of its own
  int iterations = 60;        // of each of the penalty's rounds, at most
  double time_limit = 40.0;   // s, for all rounds of one start
  double check_step = 0.001;  // s, of the grid on which the result is checked
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all cores
};

struct DesignResult {
  PiecewisePolynomial path;
  LimitUse use;              // on the check grid
  double score = 0.0;        // sigma_min of the result, by the target's Gramian
  double start_score = 0.0;  // of the random flight or figure at the start
  int iterations = 0;
  bool time_limited = false;  // ended by the time limit: differs between machines
  double seconds = 0.0;
  std::vector<double> start_results;  // scores that the other starts reached
};

// The score of any flight: sigma_min of its scaled, marginalised E2LOG Gramian (order 4).
double FlightScore(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                   const PiecewisePolynomial& path, const DesignTarget& target);

// Throws InputError where the vehicle can't hover within the limits.
DesignResult DesignFlight(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                          const DesignTarget& target, const DesignOptions& options);

// The task of trueline-design (config/design/*.yaml), by one of two criteria.

// `criterion: gramian`: sigma_min of the scaled Gramian (Boehm et al. 2020, eq. 5).
struct GramianCriterion {
  RotorDrivenSystem system;
  DesignTarget target;            // scale is filled in by RunDesignTask
  ColumnScaleOptions scale = {};  // kind and number of flights alone
};

struct DesignTask {
  std::string source;
  RotorVehicle vehicle;
  std::vector<StateInfo> show;
  DesignOptions options;  // by the bound: shape, limits, seed and threads alone
  int compare = 0;        // random flights, and as many Lissajous figures, to compare with
  std::variant<GramianCriterion, BoundDesign> criterion;  // by the Gramian, or `bound`

  bool ByBound() const { return std::holds_alternative<BoundDesign>(criterion); }
};

// Throws InputError naming file, line and key.
DesignTask ReadDesignTask(const YamlMap& config, std::uint64_t seed, int threads);

// Runs a design task and compares the result with random flights and figures.

// Scores, larger is better. Gramian: sigma_min of the scaled, marginalised Gramian. Bound: the
// factor by which the flight narrows the prior of `show` (1 / rms of sigma / prior sigma).
struct DesignOutcome {
  DesignResult result;                      // by the bound: iterations are flights tried
  std::optional<double> exact_score;        // by the exact Gramian instead of E2LOG
  std::vector<double> random_scores;        // sorted
  std::vector<double> lissajous_scores;     // sorted
  std::vector<double> sigma, random_sigma;  // Cramer-Rao (whole flight) of what is shown: designed,
                                            // and of a random flight; infinite where it can't be
                                            // flown
};

// Throws InputError if no flight keeps the limits.
DesignOutcome RunDesignTask(const DesignTask& task,
                            const std::function<void(const std::string&)>& progress);

// trajectory.yaml, trajectory.csv and score.yaml in `directory`.
void WriteDesign(const DesignTask& task, const DesignOutcome& outcome,
                 const std::filesystem::path& directory);

std::string DesignTable(const DesignTask& task, const DesignOutcome& outcome);

}  // namespace trueline
