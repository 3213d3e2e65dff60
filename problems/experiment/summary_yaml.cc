#include <fmt/format.h>

#include <cmath>

#include "problems/common/app.h"
#include "problems/common/sha256.h"
#include "problems/experiment/write_benchmark.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

constexpr int kSummaryDigits = 4;

void Put(YAML::Node* node, const std::string& key, double value) {  // skips NaN
  if (!std::isnan(value)) (*node)[key] = Rounded(value, kSummaryDigits);
}

void Put(YAML::Node* node, const std::string& key, const std::optional<Interval>& interval) {
  if (!interval) return;
  YAML::Node list;
  list.push_back(Rounded(interval->low, kSummaryDigits));
  list.push_back(Rounded(interval->high, kSummaryDigits));
  list.SetStyle(YAML::EmitterStyle::Flow);
  (*node)[key] = list;
}

YAML::Node GroupNode(const GroupSummary& g) {
  YAML::Node node;
  node["log"] = g.log;
  node["label"] = g.label;
  node["estimator"] = g.estimator;
  node["gamma"] = g.gamma;
  Put(&node, "sweep", g.x);
  node["flights"] = g.flights;
  node["arcs"] = g.error.count;
  if (g.diverged > 0) node["diverged"] = g.diverged;
  YAML::Node error;
  Put(&error, "mean", g.error.mean);
  Put(&error, "mean_interval95", g.mean_interval);
  Put(&error, "median", g.error.median);
  Put(&error, "median_interval95", g.median_interval);
  Put(&error, "p95", g.error.p95);
  Put(&error, "rms", g.rms);
  error["unit"] = "m";
  error.SetStyle(YAML::EmitterStyle::Flow);
  node["final_point_error"] = error;
  const int arcs = g.error.count + g.diverged;
  if (arcs > 0) node["inside_95_ellipse"] = Rounded(double(g.inside_95) / arcs, kSummaryDigits);
  node["iterations"]["mean"] = Rounded(g.iterations_mean, kSummaryDigits);
  node["iterations"]["max"] = g.iterations_max;
  node["iterations"].SetStyle(YAML::EmitterStyle::Flow);
  Put(&node, "bound_rms_m", g.bound_rms);
  return node;
}

// What a summary is of.
template <class Summary>
YAML::Node Head(const Summary& s) {
  YAML::Node node;
  node["log"] = s.log;
  node["label"] = s.label;
  node["gamma"] = s.gamma;
  Put(&node, "sweep", s.x);
  return node;
}

YAML::Node ConvergenceNode(const ConvergenceSummary& c) {
  YAML::Node node = Head(c);
  node["quantity"] = c.quantity;
  node["tolerance"] = c.tolerance;
  node["flights"] = c.flights;
  node["converged"] = c.converged;
  Put(&node, "median_time_s", c.median_time);
  Put(&node, "median_time_interval95", c.interval);
  return node;
}

YAML::Node ForecastNode(const ForecastSummary& f) {
  YAML::Node node = Head(f);
  node["flights"] = f.flights;
  node["horizon_s"] = f.horizon;
  node["forecasts"] = f.count;
  Put(&node, "median_error_m", f.median_error);
  for (std::size_t i = 0; i < f.inside.size(); ++i) {
    const std::string level = fmt::format("region_{:.0f}", 100.0 * kRegionLevels[i]);
    node["inside"][level] = Rounded(double(f.inside[i]) / f.count, kSummaryDigits);
  }
  node["inside"].SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node StartsNode(const std::vector<JobOutcome>& outcomes) {
  struct Total {
    int windows = 0, starts = 0, same = 0, iterations_max = 0;
    double iterations = 0.0;
  };
  std::map<std::pair<std::string, int>, Total> totals;
  for (const JobOutcome& outcome : outcomes) {
    for (const StartsRow& row : outcome.result.starts) {
      Total& total = totals[{row.label, row.gamma}];
      ++total.windows;
      total.starts += row.starts;
      total.same += row.same_optimum;
      total.iterations += row.starts * row.iterations_mean;
      total.iterations_max = std::max(total.iterations_max, row.iterations_max);
    }
  }
  YAML::Node list(YAML::NodeType::Sequence);
  for (const auto& [key, total] : totals) {
    YAML::Node node;
    node["label"] = key.first;
    node["gamma"] = key.second;
    node["windows"] = total.windows;
    node["starts"] = total.starts;
    node["same_optimum"] = Rounded(double(total.same) / total.starts, kSummaryDigits);
    node["iterations"]["mean"] = Rounded(total.iterations / total.starts, kSummaryDigits);
    node["iterations"]["max"] = total.iterations_max;
    list.push_back(node);
  }
  return list;
}

YAML::Node ChecksumsNode(const Experiment& experiment) {
  YAML::Node node;
  const auto add = [&](const fs::path& file, const std::string& name) {
    node[name] = Sha256OfFile(file);
  };
  add(experiment.file, fs::path(experiment.file).filename().string());
  for (const FlightSource& flight : experiment.flights) {
    const bool folder = flight.kind == FlightKind::kNativeLog;
    for (const fs::path& file : FilesOf(flight)) {
      add(file, (folder ? flight.name + "/" : "") + file.filename().string());
    }
  }
  return node;
}

YAML::Node ProvenanceNode(const Experiment& experiment) {
  YAML::Node node;
  node["version"] = Version();
  node["experiment"] = experiment.file;
  node["seeds"]["first"] = experiment.first_seed;
  node["seeds"]["count"] = experiment.seeds;
  node["sha256"] = ChecksumsNode(experiment);
  node["config"] = experiment.config;
  return node;
}

}  // namespace

std::string SummaryYaml(const Experiment& experiment, const ExperimentRun& run) {
  YAML::Node node;
  node["name"] = experiment.name;
  if (!experiment.about.empty()) node["about"] = experiment.about;
  if (!experiment.sweep.points.empty()) {
    node["sweep"]["name"] = experiment.sweep.name;
    node["sweep"]["unit"] = experiment.sweep.unit;
  }
  node["groups"] = YAML::Node(YAML::NodeType::Sequence);
  for (const GroupSummary& g : SummariseGroups(run.outcomes))
    node["groups"].push_back(GroupNode(g));
  for (const ConvergenceSummary& c : SummariseConvergence(run.outcomes)) {
    node["convergence"].push_back(ConvergenceNode(c));
  }
  for (const ForecastSummary& f : SummariseForecasts(run.outcomes)) {
    node["forecasts"].push_back(ForecastNode(f));
  }
  if (experiment.starts > 0) node["starts"] = StartsNode(run.outcomes);
  for (const JobOutcome& outcome : run.outcomes) {
    if (outcome.failure.empty()) continue;
    YAML::Node failure;
    failure["log"] = outcome.job.log;
    failure["seed"] = outcome.job.seed;
    Put(&failure, "sweep", outcome.job.x);
    failure["reason"] = outcome.failure;
    node["failures"].push_back(failure);
  }
  node["provenance"] = ProvenanceNode(experiment);
  return TextOf(node);
}

}  // namespace trueline
