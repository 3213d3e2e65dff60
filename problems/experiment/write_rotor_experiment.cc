#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/experiment/write_benchmark.h"
#include "problems/result/statistics.h"
#include "problems/result/yaml_text.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

using Trials = std::vector<const TrialRow*>;

constexpr double k95 = 1.959964;

// Sums over the trials of one kind; `axes` are the constants that form one score.
EstimatorScore Score(const Trials& trials, const std::vector<int>& axes,
                     TrialRow::Estimate TrialRow::*estimate) {
  EstimatorScore score;
  int inside = 0;
  for (const TrialRow* trial : trials) {
    const auto& [error, sigma] = trial->*estimate;
    if (!error.allFinite()) {
      ++score.diverged;
      continue;
    }
    for (const int i : axes) {
      const double e = error[i], s = sigma[i];
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
  score.filter = Score(trials, axes, &TrialRow::filter);
  score.ordinary = Score(trials, axes, &TrialRow::ordinary);
  score.batch = Score(trials, axes, &TrialRow::batch);
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

namespace {

constexpr int kDigits = 4;

YAML::Node EstimatorNode(const EstimatorScore& score) {
  return FlowMap({{"rmse", Rounded(score.rmse, kDigits)},
                  {"mean_error", Rounded(score.mean_error, kDigits)},
                  {"sigma", Rounded(score.sigma, kDigits)},
                  {"coverage95", Rounded(score.coverage, kDigits)},
                  {"diverged", std::to_string(score.diverged)}});
}

YAML::Node ScoresNode(const std::vector<ConstantScore>& scores) {
  YAML::Node node(YAML::NodeType::Map);
  for (const ConstantScore& score : scores) {
    YAML::Node entry;
    entry["unit"] = score.unit;
    entry["first_guess"] = Rounded(score.first_guess, kDigits);
    entry["bound"] = Rounded(score.bound, kDigits);
    entry["filter"] = EstimatorNode(score.filter);
    entry["ordinary_filter"] = EstimatorNode(score.ordinary);
    entry["batch"] = EstimatorNode(score.batch);
    node[score.name] = entry;
  }
  return node;
}

YAML::Node SummaryNode(const RotorExperiment& experiment,
                       const std::vector<KindSummary>& summaries) {
  YAML::Node node;
  node["name"] = experiment.name;
  node["about"] = experiment.about;
  for (const KindSummary& s : summaries) {
    YAML::Node kind;
    kind["name"] = s.name;
    kind["flights"] = s.flights;
    kind["failures"] = s.failures;
    kind["path_error_rms"] = Rounded(s.path_error, kDigits);
    kind["nees"]["filter"] = Rounded(s.filter_nees, kDigits);
    kind["nees"]["batch"] = Rounded(s.batch_nees, kDigits);
    kind["nees_median"]["filter"] = Rounded(s.filter_nees_median, kDigits);
    kind["nees_median"]["batch"] = Rounded(s.batch_nees_median, kDigits);
    kind["rmse_over_bound"]["filter"] = Rounded(s.filter_over_bound, kDigits);
    kind["rmse_over_bound"]["batch"] = Rounded(s.batch_over_bound, kDigits);
    kind["constants"] = ScoresNode(s.constants);
    kind["groups"] = ScoresNode(s.groups);
    node["kinds"].push_back(kind);
  }
  node["provenance"]["version"] = Version();
  node["provenance"]["source"] = experiment.file;
  node["provenance"]["seed"] = experiment.seed;
  node["provenance"]["config"] = experiment.config;
  return node;
}

void PrintTrials(const RotorExperiment& experiment, const ExperimentRun& run, std::ostream& out) {
  for (const JobOutcome& outcome : run.outcomes) {
    for (const TrialRow& t : outcome.result.trials) {
      for (const int i : experiment.prior.Free()) {
        const RotorConstantInfo& info = kRotorConstants[i];
        fmt::print(out, "{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n",
                   outcome.job.log, outcome.job.seed, info.name, info.unit, t.first_guess[i],
                   t.filter.error[i], t.filter.sigma[i], t.ordinary.error[i], t.ordinary.sigma[i],
                   t.batch.error[i], t.batch.sigma[i], t.bound[i]);
      }
    }
  }
}

// Estimates of all flights of one kind at one time.
struct Moment {
  double t = 0.0;
  int count = 0;
  RotorConstants error = RotorConstants::Zero(), square = error, variance = error;
};

std::vector<Moment> MomentsOf(const std::vector<const TrialRow*>& trials) {
  std::vector<Moment> moments;
  for (const TrialRow* trial : trials) {
    if (moments.size() < trial->history.size()) moments.resize(trial->history.size());
    for (std::size_t j = 0; j < trial->history.size(); ++j) {
      const auto& [time, estimate] = trial->history[j];
      moments[j].t = time;
      ++moments[j].count;
      moments[j].error += estimate.error;
      moments[j].square += estimate.error.cwiseAbs2();
      moments[j].variance += estimate.sigma.cwiseAbs2();
    }
  }
  return moments;
}

void PrintHistory(const RotorExperiment& experiment, const ExperimentRun& run, std::ostream& out) {
  const RotorConstants truth = TrueConstants(experiment.simulation);
  for (const FlightKindSource& kind : experiment.kinds) {
    for (const Moment& m : MomentsOf(TrialsOf(run.outcomes, kind.name))) {
      for (const int i : experiment.prior.Free()) {
        const double mean = m.error[i] / m.count, square = m.square[i] / m.count;
        fmt::print(out, "{},{:.3f},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n", kind.name, m.t,
                   kRotorConstants[i].name, kRotorConstants[i].unit, truth[i], mean,
                   std::sqrt(std::max(0.0, square - mean * mean)), std::sqrt(square),
                   std::sqrt(m.variance[i] / m.count));
      }
    }
  }
}

// The path that the experiment has designed for a job's kind of flight.
const PiecewisePolynomial* DesignedPath(const Job& job) {
  const auto& kind = *std::get<std::shared_ptr<const RotorFlightKind>>(job.flight);
  for (const FlightKindSource& source : kind.experiment.kinds) {
    if (source.name == job.log && source.kind != "file" && kind.path) return &*kind.path;
  }
  return nullptr;
}

}  // namespace

void WriteRotorExperiment(const RotorExperiment& experiment, const ExperimentRun& run,
                          const std::filesystem::path& directory) {
  for (std::size_t i = 0; i < run.outcomes.size(); i += experiment.flights) {
    const PiecewisePolynomial* path = DesignedPath(run.outcomes[i].job);
    if (path == nullptr) continue;
    std::string name = run.outcomes[i].job.log;
    std::replace_if(
        name.begin(), name.end(), [](char c) { return c == ' ' || c == '/'; }, '_');
    WriteFileAtomically(directory / ("trajectory_" + name + ".yaml"), TrajectoryYaml(*path));
  }
  WriteCsv(directory / "trials.csv",
           "kind,seed,parameter,unit,first_guess,filter_error,filter_sigma,ordinary_error,"
           "ordinary_sigma,batch_error,batch_sigma,bound",
           [&](std::ostream& out) { PrintTrials(experiment, run, out); });
  WriteCsv(directory / "history.csv",
           "kind,t [s],parameter,unit,truth,mean_error,spread,rmse,sigma",
           [&](std::ostream& out) { PrintHistory(experiment, run, out); });
  WriteFileAtomically(directory / "summary.yaml",
                      TextOf(SummaryNode(experiment, SummariseTrials(experiment, run.outcomes))));
}

std::string RotorExperimentTable(const RotorExperiment& experiment, const ExperimentRun& run) {
  std::string table;
  for (const KindSummary& s : SummariseTrials(experiment, run.outcomes)) {
    table += fmt::format("{}: {} flights{}\n", s.name, s.flights,
                         s.failures > 0 ? fmt::format(", {} without result", s.failures) : "");
    if (s.flights == 0) continue;
    table +=
        fmt::format("  {:<10}{:>11}{:>11}{:>7}{:>14}{:>11}{:>11}{:>7}{:>11}\n", "", "filter rmse",
                    "sigma", "in 95", "ordinary rmse", "batch rmse", "sigma", "in 95", "bound");
    const auto row = [&](const ConstantScore& c) {
      table += fmt::format(
          "  {:<10}{:>11.3g}{:>11.3g}{:>5.0f} %{:>14.3g}{:>11.3g}{:>11.3g}{:>5.0f} %"
          "{:>11.3g} {}\n",
          c.name, c.filter.rmse, c.filter.sigma, 100.0 * c.filter.coverage, c.ordinary.rmse,
          c.batch.rmse, c.batch.sigma, 100.0 * c.batch.coverage, c.bound, c.unit);
    };
    for (const ConstantScore& c : s.constants) row(c);
    for (const ConstantScore& c : s.groups) row(c);
    table += fmt::format(
        "  RMSE over bound: filter {:.3f}, batch {:.3f}; NEES (median): {:.2f} ({:.2f}), {:.2f} "
        "({:.2f})\n\n",
        s.filter_over_bound, s.batch_over_bound, s.filter_nees, s.filter_nees_median, s.batch_nees,
        s.batch_nees_median);
  }
  return table;
}

std::string RotorExperimentBrief(const RotorExperiment& experiment, const ExperimentRun& run) {
  std::string head, table;
  for (const KindSummary& s : SummariseTrials(experiment, run.outcomes)) {
    table += fmt::format("{:<26.25}{:>8}", s.name, s.flights);
    head = fmt::format("{:<26}{:>8}", "rms error of the batch", "flights");
    for (const ConstantScore& c : s.groups) {
      head += fmt::format("{:>15}", fmt::format("{} [{}]", c.name, c.unit));
      table += fmt::format("{:>15.3g}", c.batch.rmse);
    }
    table += fmt::format("{:>8.2f}\n", s.batch_over_bound);
  }
  return head + fmt::format("{:>8}\n", "/ bound") + table;
}

}  // namespace trueline
