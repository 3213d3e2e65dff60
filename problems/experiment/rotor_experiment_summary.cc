#include "problems/experiment/rotor_experiment_summary.h"

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

using Trials = std::vector<const RotorTrial*>;

constexpr double k95 = 1.959964;

// Sums over the trials of one kind; `axes` are the constants that form one score.
EstimatorScore Score(const Trials& trials, const std::vector<int>& axes,
                     RotorConstants RotorTrial::*error, RotorConstants RotorTrial::*sigma) {
  EstimatorScore score;
  int inside = 0;
  for (const RotorTrial* trial : trials) {
    for (const int i : axes) {
      const double e = (trial->*error)[i], s = (trial->*sigma)[i];
      score.rmse += e * e;
      score.mean_error += e;
      score.sigma += s * s;
      inside += std::abs(e) <= k95 * s ? 1 : 0;
    }
  }
  const auto n = static_cast<double>(trials.size());
  score.rmse = std::sqrt(score.rmse / n);
  score.mean_error /= n;
  score.sigma = std::sqrt(score.sigma / n);
  score.coverage = inside / (n * static_cast<double>(axes.size()));
  return score;
}

double RootMean(const Trials& trials, const std::vector<int>& axes,
                RotorConstants RotorTrial::*value) {
  double sum = 0.0;
  for (const RotorTrial* trial : trials) {
    for (const int i : axes) sum += std::pow((trial->*value)[i], 2);
  }
  return std::sqrt(sum / static_cast<double>(trials.size()));
}

ConstantScore ScoreOf(const Trials& trials, const std::string& name, const std::vector<int>& axes) {
  ConstantScore score;
  score.name = name;
  score.unit = RotorConstantNames()[axes.front()].unit;
  score.filter = Score(trials, axes, &RotorTrial::filter_error, &RotorTrial::filter_sigma);
  score.batch = Score(trials, axes, &RotorTrial::batch_error, &RotorTrial::batch_sigma);
  score.bound = RootMean(trials, axes, &RotorTrial::bound);
  score.first_guess = RootMean(trials, axes, &RotorTrial::first_guess);
  return score;
}

double OverBound(const KindSummary& summary, EstimatorScore ConstantScore::*estimator) {
  double sum = 0.0;
  for (const ConstantScore& c : summary.constants) {
    sum += std::pow((c.*estimator).rmse / c.bound, 2);
  }
  return std::sqrt(sum / static_cast<double>(summary.constants.size()));
}

double Median(const Trials& trials, double RotorTrial::*value) {
  std::vector<double> values;
  values.reserve(trials.size());
  for (const RotorTrial* trial : trials) values.push_back(trial->*value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

KindSummary Summarise(const std::string& name, const Trials& trials, const std::vector<int>& free) {
  KindSummary summary;
  summary.name = name;
  summary.flights = static_cast<int>(trials.size());
  if (trials.empty()) return summary;
  for (const int i : free) {
    summary.constants.push_back(ScoreOf(trials, RotorConstantNames()[i].name, {i}));
  }
  for (const char* group : {"I", "r_BM", "r_BP", "r_BI", "b_a", "b_w"}) {
    std::vector<int> axes;
    for (const int i : free) {
      const std::string& full = RotorConstantNames()[i].name;
      if (full.substr(0, full.rfind('_')) == group) axes.push_back(i);
    }
    if (!axes.empty()) summary.groups.push_back(ScoreOf(trials, group, axes));
  }
  const auto n = static_cast<double>(trials.size());
  for (const RotorTrial* trial : trials) {
    summary.filter_nees += trial->filter_nees / n;
    summary.batch_nees += trial->batch_nees / n;
    summary.path_error += trial->path_error * trial->path_error / n;
  }
  summary.path_error = std::sqrt(summary.path_error);
  summary.filter_nees_median = Median(trials, &RotorTrial::filter_nees);
  summary.batch_nees_median = Median(trials, &RotorTrial::batch_nees);
  summary.batch_over_bound = OverBound(summary, &ConstantScore::batch);
  summary.filter_over_bound = OverBound(summary, &ConstantScore::filter);
  return summary;
}

}  // namespace

std::vector<KindSummary> SummariseRotorTrials(const RotorExperiment& experiment,
                                              const std::vector<RotorTrial>& trials) {
  std::vector<KindSummary> summaries;
  for (std::size_t k = 0; k < experiment.kinds.size(); ++k) {
    Trials own;
    int failures = 0;
    for (const RotorTrial& trial : trials) {
      if (trial.kind != static_cast<int>(k)) continue;
      if (trial.failure.empty()) {
        own.push_back(&trial);
      } else {
        ++failures;
      }
    }
    summaries.push_back(Summarise(experiment.kinds[k].name, own, experiment.prior.Free()));
    summaries.back().failures = failures;
  }
  return summaries;
}

}  // namespace trueline
