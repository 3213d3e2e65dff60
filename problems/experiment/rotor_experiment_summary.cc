#include "problems/experiment/rotor_experiment_summary.h"

#include <cmath>
#include <limits>

#include "problems/result/statistics.h"

namespace trueline {
namespace {

using Trials = std::vector<const TrialRow*>;

constexpr double k95 = 1.959964;

// Sums over the trials of one kind; `axes` are the constants that form one score.
EstimatorScore Score(const Trials& trials, const std::vector<int>& axes,
                     RotorConstants TrialRow::*error, RotorConstants TrialRow::*sigma) {
  EstimatorScore score;
  int inside = 0;
  for (const TrialRow* trial : trials) {
    if (!(trial->*error).allFinite()) {
      ++score.diverged;
      continue;
    }
    for (const int i : axes) {
      const double e = (trial->*error)[i], s = (trial->*sigma)[i];
      score.rmse += e * e;
      score.mean_error += e;
      score.sigma += s * s;
      inside += std::abs(e) <= k95 * s ? 1 : 0;
    }
  }
  const auto n = static_cast<double>(trials.size()) - score.diverged;
  score.rmse = std::sqrt(score.rmse / n);
  score.mean_error /= n;
  score.sigma = std::sqrt(score.sigma / n);
  score.coverage = inside / (n * static_cast<double>(axes.size()));
  return score;
}

double RootMean(const Trials& trials, const std::vector<int>& axes,
                RotorConstants TrialRow::*value) {
  double sum = 0.0;
  for (const TrialRow* trial : trials) {
    for (const int i : axes) sum += std::pow((trial->*value)[i], 2);
  }
  return std::sqrt(sum / static_cast<double>(trials.size()));
}

ConstantScore ScoreOf(const Trials& trials, const std::string& name, const std::vector<int>& axes) {
  ConstantScore score;
  score.name = name;
  score.unit = kRotorConstants[axes.front()].unit;
  score.filter = Score(trials, axes, &TrialRow::filter_error, &TrialRow::filter_sigma);
  score.ordinary = Score(trials, axes, &TrialRow::ordinary_error, &TrialRow::ordinary_sigma);
  score.batch = Score(trials, axes, &TrialRow::batch_error, &TrialRow::batch_sigma);
  score.bound = RootMean(trials, axes, &TrialRow::bound);
  score.first_guess = RootMean(trials, axes, &TrialRow::first_guess);
  return score;
}

double OverBound(const KindSummary& summary, EstimatorScore ConstantScore::*estimator) {
  double sum = 0.0;
  for (const ConstantScore& c : summary.constants) {
    sum += std::pow((c.*estimator).rmse / c.bound, 2);
  }
  return std::sqrt(sum / static_cast<double>(summary.constants.size()));
}

std::vector<double> ValuesOf(const Trials& trials, double TrialRow::*value) {
  std::vector<double> values;
  values.reserve(trials.size());
  for (const TrialRow* trial : trials) values.push_back(trial->*value);
  return values;
}

KindSummary Summarise(const std::string& name, const Trials& trials, const std::vector<int>& free) {
  KindSummary summary;
  summary.name = name;
  summary.flights = static_cast<int>(trials.size());
  if (trials.empty()) {
    for (double* none : {&summary.path_error, &summary.filter_nees, &summary.batch_nees,
                         &summary.filter_nees_median, &summary.batch_nees_median,
                         &summary.batch_over_bound, &summary.filter_over_bound}) {
      *none = std::numeric_limits<double>::quiet_NaN();
    }
    return summary;
  }
  for (const int i : free) {
    summary.constants.push_back(ScoreOf(trials, kRotorConstants[i].name, {i}));
  }
  for (const char* group : {"I", "r_BM", "r_BP", "r_BI", "b_a", "b_w"}) {
    std::vector<int> axes;
    for (const int i : free) {
      const std::string& full = kRotorConstants[i].name;
      if (full.substr(0, full.rfind('_')) == group) axes.push_back(i);
    }
    if (!axes.empty()) summary.groups.push_back(ScoreOf(trials, group, axes));
  }
  const std::vector<double> filter = ValuesOf(trials, &TrialRow::filter_nees);
  const std::vector<double> batch = ValuesOf(trials, &TrialRow::batch_nees);
  summary.path_error = RootMeanSquare(ValuesOf(trials, &TrialRow::path_error));
  summary.filter_nees = Mean(filter);
  summary.batch_nees = Mean(batch);
  summary.filter_nees_median = UpperMedian(filter);
  summary.batch_nees_median = UpperMedian(batch);
  summary.batch_over_bound = OverBound(summary, &ConstantScore::batch);
  summary.filter_over_bound = OverBound(summary, &ConstantScore::filter);
  return summary;
}

}  // namespace

std::vector<const TrialRow*> TrialsOf(const std::vector<JobOutcome>& outcomes,
                                      const std::string& kind) {
  std::vector<const TrialRow*> trials;
  for (const JobOutcome& outcome : outcomes) {
    if (outcome.job.log != kind) continue;
    for (const TrialRow& trial : outcome.result.trials) trials.push_back(&trial);
  }
  return trials;
}

std::vector<KindSummary> SummariseTrials(const RotorExperiment& experiment,
                                         const std::vector<JobOutcome>& outcomes) {
  std::vector<KindSummary> summaries;
  for (const FlightKindSource& kind : experiment.kinds) {
    summaries.push_back(
        Summarise(kind.name, TrialsOf(outcomes, kind.name), experiment.prior.Free()));
    summaries.back().failures = experiment.flights - summaries.back().flights;
  }
  return summaries;
}

}  // namespace trueline
