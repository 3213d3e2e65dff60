// Figures of a benchmark: for each flight source, label, gamma and sweep value, over all seeds.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "problems/experiment/job.h"
#include "problems/result/statistics.h"

namespace trueline {

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

}  // namespace trueline
