#include "problems/experiment/write_benchmark.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/parallel.h"
#include "problems/result/yaml_text.h"

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

namespace {

std::string Number(double value, const char* format = "{:.6g}") {  // empty for NaN
  return std::isnan(value) ? "" : fmt::format(fmt::runtime(format), value);
}

// Calls `write(file, job, row)` for all rows of one kind; no file without rows, except for arcs.
template <class Row, class Write>
void WriteTable(const ExperimentRun& run, std::vector<Row> JobResult::*rows,
                const std::filesystem::path& path, const char* header, const Write& write) {
  const bool none = std::ranges::all_of(
      run.outcomes, [&](const JobOutcome& outcome) { return (outcome.result.*rows).empty(); });
  if (none && !std::is_same_v<Row, ArcRow>) {
    std::filesystem::remove(path);  // of an earlier run
    return;
  }
  WriteCsv(path, header, [&](std::ostream& out) {
    for (const JobOutcome& outcome : run.outcomes) {
      for (const Row& row : outcome.result.*rows) write(out, outcome.job, row);
    }
  });
}

void WriteTiming(const ExperimentRun& run, int threads, const std::filesystem::path& path) {
  WriteFileAtomically(
      path, fmt::format("threads: {}\nwall_time: {:.3f}  # s\nflights: {}\n"
                        "flights_reused: {}  # from an earlier run\n",
                        CoresFor(threads), run.wall_time, run.outcomes.size(), run.reused));
}

std::string Share(int part, int whole) {
  return whole > 0 ? fmt::format("{:.0f} %", 100.0 * part / whole) : "-";
}

std::string ForecastTable(const std::vector<JobOutcome>& outcomes) {
  const std::vector<ForecastSummary> forecasts = SummariseForecasts(outcomes);
  if (forecasts.empty()) return "";
  std::string text = fmt::format("\n{:<18}{:<22}{:>6}{:>9}{:>12}{:>8}{:>12}{:>9}{:>9}{:>9}\n",
                                 "log", "label", "gamma", "sweep", "horizon [s]", "count",
                                 "median [m]", "in 50", "in 90", "in 95");
  for (const ForecastSummary& f : forecasts) {
    text += fmt::format("{:<18.17}{:<22.21}{:>6}{:>9}{:>12}{:>8}{:>12.3f}{:>9}{:>9}{:>9}\n", f.log,
                        f.label, f.gamma, Number(f.x), f.horizon, f.count, f.median_error,
                        Share(f.inside[0], f.count), Share(f.inside[1], f.count),
                        Share(f.inside[2], f.count));
  }
  return text;
}

}  // namespace

void WriteBenchmark(const Experiment& experiment, const ExperimentRun& run, int threads, bool times,
                    const std::filesystem::path& directory) {
  WriteTable(run, &JobResult::arcs, directory / "arcs.csv",
             "log,estimator,gamma,tau,t_start [s],t_end [s],final_point_error [m],predicted_sigma "
             "[m],iterations [1],solve_time [s],truth,label,sweep,seed,inside_95 [1],counted "
             "[1],bound [m]",
             [times](std::ostream& out, const Job& job, const ArcRow& r) {
               fmt::print(out, "{},{},{},{},{:.9f},{:.9f},{},{:.6g},{},{},{},{},{},{},{},{},{}\n",
                          job.log, r.estimator, r.gamma, r.tau, r.begin, r.end, Number(r.error),
                          r.predicted_sigma, r.iterations, times ? Number(r.solve_time) : "",
                          r.truth, r.label, Number(job.x), job.seed,
                          r.truth == "none" ? "" : fmt::format("{}", int(r.inside_95)),
                          int(r.counted), Number(r.bound));
             });
  WriteTable(run, &JobResult::convergence, directory / "convergence.csv",
             "log,label,gamma,sweep,seed,quantity,tolerance,windows,time [s]",
             [](std::ostream& out, const Job& job, const ConvergenceRow& r) {
               fmt::print(out, "{},{},{},{},{},{},{},{},{}\n", job.log, r.label, r.gamma,
                          Number(job.x), job.seed, r.quantity, r.tolerance, r.windows,
                          Number(r.time));
             });
  WriteTable(run, &JobResult::starts, directory / "starts.csv",
             "log,label,gamma,sweep,seed,tau,starts,same_optimum,iterations_mean,iterations_max",
             [](std::ostream& out, const Job& job, const StartsRow& r) {
               fmt::print(out, "{},{},{},{},{},{},{},{},{:.4g},{}\n", job.log, r.label, r.gamma,
                          Number(job.x), job.seed, r.tau, r.starts, r.same_optimum,
                          r.iterations_mean, r.iterations_max);
             });
  WriteTable(run, &JobResult::forecasts, directory / "forecasts.csv",
             "log,label,gamma,sweep,seed,tau,horizon [s],error [m],sigma [m],rank [1]",
             [](std::ostream& out, const Job& job, const ForecastRow& r) {
               fmt::print(out, "{},{},{},{},{},{},{},{:.6g},{:.6g},{:.6g}\n", job.log, r.label,
                          r.gamma, Number(job.x), job.seed, r.tau, r.horizon, r.error, r.sigma,
                          r.rank);
             });
  WriteTable(run, &JobResult::paths, directory / "trajectory.csv",
             "label,kind,tau,t [s],x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]",
             [](std::ostream& out, const Job&, const PathRow& r) {
               fmt::print(out, "{},{},{},{:.6f},{:.4f},{:.4f},{:.4f},{},{},{}\n", r.label, r.kind,
                          r.tau, r.t, r.x, r.y, r.z, Number(r.vx, "{:.4f}"), Number(r.vy, "{:.4f}"),
                          Number(r.vz, "{:.4f}"));
             });
  WriteTable(run, &JobResult::estimates, directory / "estimates.csv",
             "label,tau,t [s],name,unit,value,sigma,truth",
             [](std::ostream& out, const Job&, const EstimateRow& r) {
               fmt::print(out, "{},{},{:.6f},{},{},{:.6g},{:.6g},{}\n", r.label, r.tau, r.t, r.name,
                          r.unit, r.value, r.sigma, Number(r.truth));
             });
  WriteFileAtomically(directory / "summary.yaml", SummaryYaml(experiment, run));
  WriteTiming(run, threads, directory / "timing.yaml");
}

namespace {

// One number for each log and for each label, gamma, sweep and `what` of it.
class ByLog {
 public:
  template <class Row>
  void Add(const Row& row, const std::string& what, const std::string& number) {
    Place(row.log, &logs_);
    const std::string name =
        fmt::format("{:<22.21}{:>6}{:>9}{:>20}", row.label, row.gamma, Number(row.x), what);
    Place(name, &names_);
    numbers_[{name, row.log}] = number;
  }
  [[nodiscard]] std::string Text(const std::string& what) const {
    if (names_.empty()) return "";
    std::string text = fmt::format("{:<22}{:>6}{:>9}{:>20}", what, "gamma", "sweep", "");
    for (const std::string& log : logs_) text += fmt::format("{:>15.14}", log);
    for (const std::string& name : names_) {
      text += "\n" + name;
      for (const std::string& log : logs_) {
        const auto found = numbers_.find({name, log});
        text += fmt::format("{:>15}", found == numbers_.end() ? "" : found->second);
      }
    }
    return text + "\n";
  }

 private:
  static void Place(const std::string& name, std::vector<std::string>* names) {
    if (std::ranges::find(*names, name) == names->end()) names->push_back(name);
  }

  std::vector<std::string> logs_, names_;
  std::map<std::pair<std::string, std::string>, std::string> numbers_;
};

std::string TimeText(const ConvergenceSummary& c) {
  return std::isinf(c.median_time) ? "not reached" : fmt::format("{:.1f}", c.median_time);
}

}  // namespace

std::string BenchmarkBrief(const ExperimentRun& run) {
  ByLog errors, times;
  for (const GroupSummary& g : SummariseGroups(run.outcomes)) {
    errors.Add(g, "", fmt::format("{:.3f}", g.error.mean));
  }
  for (const ConvergenceSummary& c : SummariseConvergence(run.outcomes)) {
    times.Add(c, fmt::format("{} < {}", c.quantity, c.tolerance), TimeText(c));
  }
  return errors.Text("mean error [m]") + ForecastTable(run.outcomes) +
         times.Text("\nmedian time [s]");
}

std::string BenchmarkTable(const Experiment& experiment, const ExperimentRun& run) {
  std::string text =
      fmt::format("{:<18}{:<22}{:>6}{:>9}{:>8}{:>9}{:>9}{:>9}{:>7}{:>9}{:>9}\n", "log", "label",
                  "gamma", experiment.sweep.name.empty() ? "" : "sweep", "arcs", "mean [m]",
                  "median", "rms", "in 95", "iter.", "bound");
  for (const GroupSummary& g : SummariseGroups(run.outcomes)) {
    text +=
        fmt::format("{:<18.17}{:<22.21}{:>6}{:>9}{:>8}{:>9.3f}{:>9.3f}{:>9.3f}{:>7}{:>9.1f}{:>9}\n",
                    g.log, g.label, g.gamma, Number(g.x), g.error.count, g.error.mean,
                    g.error.median, g.rms, Share(g.inside_95, g.error.count + g.diverged),
                    g.iterations_mean, Number(g.bound_rms, "{:.3f}"));
  }
  text += ForecastTable(run.outcomes);
  const auto times = SummariseConvergence(run.outcomes);
  if (times.empty()) return text;
  text += fmt::format("\n{:<18}{:<22}{:>6}{:>9}{:>20}{:>11}{:>11}{:>15}\n", "log", "label", "gamma",
                      "sweep", "inside", "tolerance", "flights", "median [s]");
  for (const ConvergenceSummary& c : times) {
    text += fmt::format("{:<18.17}{:<22.21}{:>6}{:>9}{:>20}{:>11}{:>11}{:>15}\n", c.log, c.label,
                        c.gamma, Number(c.x), c.quantity, c.tolerance,
                        Share(c.converged, c.flights), TimeText(c));
  }
  return text;
}

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
