#include "problems/observability/write_design.h"

#include <fmt/ranges.h>

#include <cmath>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/units.h"
#include "problems/result/statistics.h"
#include "problems/result/yaml_text.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

std::string ScoreMeaning(const DesignTask& task) {
  return task.ByBound() ? "times that the flight narrows the prior of what it shows, rms"
                        : "sigma_min of the scaled, marginalised E2LOG Gramian";
}

std::string LimitsYaml(const DesignTask& task, const LimitUse& use) {
  const FlightLimits& limits = task.options.limits;
  std::string text = fmt::format("limits:  # on a grid of {} s\n", task.options.check_step);
  const auto add = [&](const char* name, double used, double limit, const char* unit) {
    text +=
        fmt::format("  {}: {{used: {:.6g}, limit: {:.6g}, unit: {}}}\n", name, used, limit, unit);
  };
  add("travel", use.travel, limits.travel, "m");
  add("rate", use.rate, limits.rate, "rad/s");
  if (std::isfinite(limits.tilt)) add("tilt", use.tilt, limits.tilt, "rad");
  add("min_speed", use.min_speed, limits.min_speed, "rad/s");
  add("max_speed", use.max_speed, limits.max_speed, "rad/s");
  if (std::isfinite(limits.roll)) add("roll", use.roll, limits.roll, "rad");
  if (std::isfinite(limits.pitch)) add("pitch", use.pitch, limits.pitch, "rad");
  return text;
}

std::string ComparedYaml(const DesignTask& task, const DesignOutcome& outcome) {
  if (outcome.random_scores.empty()) return "";
  std::string text = "compared:\n";
  const auto add = [&](const char* name, const std::vector<double>& scores) {
    text += fmt::format("  {}: {{count: {}, median: {:.6g}, best: {:.6g}}}\n", name, task.compare,
                        UpperMedian(scores), scores.back());
  };
  add("random", outcome.random_scores);
  add("lissajous", outcome.lissajous_scores);
  return text;
}

std::string ScoreYaml(const DesignTask& task, const DesignOutcome& outcome) {
  const DesignResult& r = outcome.result;
  std::vector<std::string> names;
  names.reserve(task.show.size());
  for (const StateInfo& state : task.show) names.push_back(state.name);
  std::string text = fmt::format(
      "provenance: {{version: {}, source: {}, seed: {}}}\nshow: [{}]\ncriterion: {}\n"
      "score: {:.6g}  # {}\n",
      Version(), Quoted(task.source), task.options.seed, fmt::join(names, ", "),
      task.ByBound() ? "bound" : "gramian", r.score, ScoreMeaning(task));
  if (outcome.exact_score) {
    text += fmt::format("exact_score: {:.6g}  # by the exact Gramian\n", *outcome.exact_score);
  }
  text += fmt::format("start_score: {:.6g}\n", r.start_score);
  if (!r.start_results.empty()) {
    text += fmt::format("all_starts: [{:.6g}]\n", fmt::join(r.start_results, ", "));
  }
  text += fmt::format("iterations: {}\ntime_limited: {}\nseconds: {:.1f}\n", r.iterations,
                      r.time_limited, r.seconds);
  text += LimitsYaml(task, r.use) + "crlb_whole_flight:\n";
  const auto value = [](double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : ".inf"; };
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("  {}: {{value: {}, random: {}, unit: {}}}\n", names[i],
                        value(outcome.sigma[i]), value(outcome.random_sigma[i]), task.show[i].unit);
  }
  return text + ComparedYaml(task, outcome);
}

}  // namespace

void WriteDesign(const DesignTask& task, const DesignOutcome& outcome,
                 const std::filesystem::path& directory) {
  const RotorFlight flight(task.vehicle, outcome.result.path);
  WriteFileAtomically(directory / "trajectory.yaml", TrajectoryYaml(outcome.result.path));
  WriteFileAtomically(directory / "trajectory.csv", TrajectoryCsv(flight, 100.0));
  WriteFileAtomically(directory / "score.yaml", ScoreYaml(task, outcome));
}

std::string DesignTable(const DesignTask& task, const DesignOutcome& outcome) {
  const DesignResult& r = outcome.result;
  const FlightLimits& limits = task.options.limits;
  std::string text = fmt::format("score {:.4g} ({}), from {:.4g} of its start; {:.1f} s, {} {}\n",
                                 r.score, ScoreMeaning(task), r.start_score, r.seconds,
                                 r.iterations, task.ByBound() ? "flights tried" : "iterations");
  if (!outcome.random_scores.empty()) {
    text += fmt::format(
        "random flights ({0}): median {1:.4g}, best {2:.4g}; Lissajous figures ({0}): "
        "median {3:.4g}, best {4:.4g}\n",
        task.compare, UpperMedian(outcome.random_scores), outcome.random_scores.back(),
        UpperMedian(outcome.lissajous_scores), outcome.lissajous_scores.back());
  }
  if (outcome.exact_score) {
    text += fmt::format("score by the exact Gramian: {:.4g}\n", *outcome.exact_score);
  }
  text += fmt::format("\n{:<12} {:>12} {:>12}  unit\n", "parameter", "sigma", "random");
  for (std::size_t i = 0; i < outcome.sigma.size(); ++i) {
    text += fmt::format("{:<12} {:>12.3e} {:>12.3e}  {}\n", task.show[i].name, outcome.sigma[i],
                        outcome.random_sigma[i], task.show[i].unit);
  }
  const auto row = [&](const char* name, double used, double limit, const char* unit) {
    text += fmt::format("{:<12} {:>12.4g} {:>12.4g}  {}\n", name, used, limit, unit);
  };
  text += fmt::format("\n{:<12} {:>12} {:>12}  unit\n", "limit", "used", "allowed");
  row("travel", r.use.travel, limits.travel, "m");
  row("body rate", r.use.rate, limits.rate, "rad/s");
  const auto angle = [&](const char* name, double used, double limit) {
    if (std::isfinite(limit)) row(name, used / kDegree, limit / kDegree, "deg");
  };
  angle("tilt", r.use.tilt, limits.tilt);
  angle("roll", r.use.roll, limits.roll);
  angle("pitch", r.use.pitch, limits.pitch);
  row("slowest", r.use.min_speed / kRpm, limits.min_speed / kRpm, "rpm");
  row("fastest", r.use.max_speed / kRpm, limits.max_speed / kRpm, "rpm");
  return text;
}

}  // namespace trueline
