#include "problems/experiment/benchmark_summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace trueline {
namespace {

// Rows of one group, by flight.
template <class Row>
struct Group {
  const Job* job = nullptr;
  std::vector<std::vector<const Row*>> flights;
};

// Groups the rows of all jobs by (log, sweep value, key of the row), in order of first occurrence;
// one summary of each group.
template <class Row, class KeyOf, class Summary>
std::vector<Summary> SummariseRows(const std::vector<JobOutcome>& outcomes,
                                   std::vector<Row> JobResult::*rows, const KeyOf& key_of,
                                   Summary (*summarise)(const Group<Row>&)) {
  using Key = decltype(key_of(std::declval<Row>()));
  std::map<std::tuple<std::string, int, Key>, std::size_t> index;
  std::vector<Group<Row>> groups;
  for (const JobOutcome& outcome : outcomes) {
    std::map<std::size_t, std::vector<const Row*>> of_job;
    for (const Row& row : outcome.result.*rows) {
      const auto [place, is_new] =
          index.try_emplace({outcome.job.log, outcome.job.sweep_index, key_of(row)}, groups.size());
      if (is_new) groups.push_back({&outcome.job, {}});
      of_job[place->second].push_back(&row);
    }
    for (auto& [group, members] : of_job) groups[group].flights.push_back(std::move(members));
  }
  std::vector<Summary> summaries;
  for (const Group<Row>& group : groups) summaries.push_back(summarise(group));
  return summaries;
}

template <class Row>
GroupLabel LabelOf(const Group<Row>& rows) {
  const Row& first = *rows.flights.front().front();
  return {rows.job->log,         first.label, first.gamma,
          rows.job->sweep_index, rows.job->x, static_cast<int>(rows.flights.size())};
}

// Counts one flight's arcs; returns the finite errors.
std::vector<double> CountArcs(const std::vector<const ArcRow*>& arcs, GroupSummary* group,
                              std::vector<double>* iterations, std::vector<double>* bounds) {
  std::vector<double> errors;
  for (const ArcRow* arc : arcs) {
    iterations->push_back(arc->iterations);
    if (!arc->counted) continue;
    group->inside_95 += arc->inside_95;
    if (std::isfinite(arc->bound)) bounds->push_back(arc->bound);
    if (std::isfinite(arc->error)) {
      errors.push_back(arc->error);
    } else {
      ++group->diverged;
    }
  }
  return errors;
}

GroupSummary SummariseGroup(const Group<ArcRow>& rows) {
  const ArcRow& first = *rows.flights.front().front();
  GroupSummary group{LabelOf(rows), first.estimator};
  std::vector<double> iterations, bounds, pooled;
  std::vector<std::vector<double>> errors;
  for (const auto& arcs : rows.flights) {
    errors.push_back(CountArcs(arcs, &group, &iterations, &bounds));
    pooled.insert(pooled.end(), errors.back().begin(), errors.back().end());
  }
  group.error = Summarise(pooled);
  group.mean_interval = BootstrapInterval(errors, Mean);
  group.median_interval =
      BootstrapInterval(errors, [](const std::vector<double>& v) { return Quantile(v, 0.5); });
  group.iterations_mean = Mean(iterations);
  group.iterations_max = static_cast<int>(*std::max_element(iterations.begin(), iterations.end()));
  group.rms = RootMeanSquare(pooled);
  group.bound_rms = RootMeanSquare(bounds);
  return group;
}

ConvergenceSummary SummariseTimes(const Group<ConvergenceRow>& rows) {
  const ConvergenceRow& first = *rows.flights.front().front();
  ConvergenceSummary summary{LabelOf(rows), first.quantity, first.tolerance};
  std::vector<double> times;
  std::vector<std::vector<double>> by_flight;
  for (const auto& flight : rows.flights) {
    const double time = flight.front()->time;
    times.push_back(std::isfinite(time) ? time : std::numeric_limits<double>::infinity());
    summary.converged += std::isfinite(time);
    by_flight.push_back({times.back()});
  }
  summary.median_time = LowerMedian(times);
  summary.interval = BootstrapInterval(by_flight, LowerMedian);
  return summary;
}

ForecastSummary SummariseForecast(const Group<ForecastRow>& rows) {
  ForecastSummary summary{LabelOf(rows), rows.flights.front().front()->horizon};
  std::vector<double> errors;
  for (const auto& flight : rows.flights) {
    for (const ForecastRow* row : flight) {
      errors.push_back(row->error);
      for (std::size_t i = 0; i < kRegionLevels.size(); ++i) {
        summary.inside[i] += row->rank <= kRegionLevels[i];
      }
    }
  }
  summary.count = static_cast<int>(errors.size());
  summary.median_error = Quantile(errors, 0.5);
  return summary;
}

}  // namespace

std::vector<GroupSummary> SummariseGroups(const std::vector<JobOutcome>& outcomes) {
  const auto key = [](const ArcRow& row) { return std::pair(row.label, row.gamma); };
  return SummariseRows(outcomes, &JobResult::arcs, key, SummariseGroup);
}

std::vector<ForecastSummary> SummariseForecasts(const std::vector<JobOutcome>& outcomes) {
  const auto key = [](const ForecastRow& row) {
    return std::tuple(row.label, row.gamma, row.horizon);
  };
  return SummariseRows(outcomes, &JobResult::forecasts, key, SummariseForecast);
}

std::vector<ConvergenceSummary> SummariseConvergence(const std::vector<JobOutcome>& outcomes) {
  const auto key = [](const ConvergenceRow& row) {
    return std::tuple(row.label, row.gamma, row.quantity);
  };
  return SummariseRows(outcomes, &JobResult::convergence, key, SummariseTimes);
}

}  // namespace trueline
