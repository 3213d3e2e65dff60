#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/parallel.h"
#include "problems/common/units.h"
#include "problems/observability/assessment.h"
#include "problems/observability/bound_design.h"
#include "problems/observability/design.h"
#include "problems/observability/variational_gramian.h"
#include "problems/result/statistics.h"
#include "problems/result/yaml_text.h"
#include "problems/trajectory/limits.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

using Progress = std::function<void(const std::string&)>;
using DrawFlight = std::function<PiecewisePolynomial(Random*)>;

PiecewisePolynomial DrawRandom(const DesignTask& task, Random* random) {
  return RandomFeasibleFlight(task.vehicle, task.options.shape, task.options.limits, random);
}

// A Lissajous figure with its amplitude cut to the limits.
PiecewisePolynomial DrawFigure(const DesignTask& task, Random* random) {
  const Lissajous figure = RandomFigure(0.5 * task.options.limits.travel, 2.0, random);
  return ScaledToLimits(task.vehicle, LissajousPath(figure, task.options.shape.duration),
                        task.options.limits, 0.02, 2.0);
}

// Scores of `task.compare` flights, sorted.
std::vector<double> Scores(const DesignTask& task, const std::string& stream,
                           const DrawFlight& draw,
                           const std::function<double(const PiecewisePolynomial&)>& score) {
  std::vector<double> scores(task.compare);
  ParallelFor(task.compare, task.options.threads, [&](int i) {
    Random random(task.options.seed + 1000 + i, stream);
    scores[i] = score(draw(&random));
  });
  std::sort(scores.begin(), scores.end());
  return scores;
}

void Compare(const DesignTask& task, const std::function<double(const PiecewisePolynomial&)>& score,
             const Progress& progress, DesignOutcome* outcome) {
  if (task.compare == 0) return;
  progress(fmt::format("{} random flights and as many Lissajous figures", task.compare));
  outcome->random_scores = Scores(
      task, "compare", [&](Random* r) { return DrawRandom(task, r); }, score);
  outcome->lissajous_scores = Scores(
      task, "lissajous", [&](Random* r) { return DrawFigure(task, r); }, score);
}

double ExactScore(const GramianCriterion& criterion, const DesignTarget& target,
                  const RotorFlight& flight) {
  const Eigen::MatrixXd gramian =
      VariationalGramian(criterion.system, flight.Nominal(), target.weights, 0.01);
  return ScoreStates(gramian, target.interest, target.asked, target.scale).sigma_min;
}

// The exact Gramian's bounds on the states of interest.
std::vector<double> GramianBounds(const GramianCriterion& criterion, const RotorFlight& flight) {
  const RotorDrivenSystem& system = criterion.system;
  const DesignTarget& target = criterion.target;
  const Eigen::MatrixXd information =
      VariationalGramian(system, flight.Nominal(), system.OutputWeights(), 0.01);
  return SigmasOf(Assess(information, target.asked, system.errors()), target.interest);
}

DesignOutcome DesignByGramian(const DesignTask& task, const GramianCriterion& criterion,
                              const Progress& progress) {
  const DesignOptions& options = task.options;
  if (criterion.scale.kind != ColumnScale::kTypical) {
    progress(fmt::format("{} random flights for the scale of each state", criterion.scale.flights));
  }
  DesignTarget target = criterion.target;
  target.scale = FindColumnScale(criterion.system, task.vehicle, target.asked,
                                 {criterion.scale.kind, criterion.scale.flights, options.shape,
                                  options.limits, options.seed, options.threads});
  progress(fmt::format("design from the best {} of {} {}", options.starts, options.candidates,
                       options.random_only ? "random flights" : "random flights and figures"));
  DesignOutcome outcome{
      DesignFlight(criterion.system, task.vehicle, target, options), {}, {}, {}, {}, {}};
  const RotorFlight flight(task.vehicle, outcome.result.path);
  outcome.exact_score = ExactScore(criterion, target, flight);
  outcome.sigma = GramianBounds(criterion, flight);
  Random random(options.seed, "design");
  outcome.random_sigma =
      GramianBounds(criterion, RotorFlight(task.vehicle, DrawRandom(task, &random)));
  Compare(
      task,
      [&](const PiecewisePolynomial& path) {
        return FlightScore(criterion.system, task.vehicle, path, target);
      },
      progress, &outcome);
  return outcome;
}

// Bounds on the constants in `show`; infinite if the flight cannot be flown.
std::vector<double> ShownSigmas(const BoundDesign& design, const PiecewisePolynomial& path) {
  const std::vector<double> all = FlownSigmas(design, path);
  std::vector<double> sigma(design.show.size(), INFINITY);
  for (std::size_t i = 0; i < sigma.size() && !all.empty(); ++i) sigma[i] = all[design.show[i]];
  return sigma;
}

DesignOutcome DesignByBound(const DesignTask& task, const BoundDesign& design,
                            const Progress& progress) {
  const DesignOptions& options = task.options;
  const auto started = std::chrono::steady_clock::now();
  const auto score = [&](const PiecewisePolynomial& path) {
    return 1.0 / std::sqrt(FlownBound(design, path));
  };
  progress(fmt::format("{} Lissajous figures, the best of which is evolved on {} flights",
                       design.candidates, design.evaluations));
  const DesignedFigure figure = DesignFigure(design, progress);
  Random random(options.seed, "design");
  DesignOutcome outcome{
      {figure.path,
       CheckLimits(RotorFlight(task.vehicle, figure.path), options.limits, options.check_step),
       score(figure.path),
       1.0 / std::sqrt(figure.start_bound),
       design.evaluations,
       false,
       0.0,
       {}},
      {},
      {},
      {},
      ShownSigmas(design, figure.path),
      ShownSigmas(design, DrawRandom(task, &random))};
  outcome.result.seconds = SecondsSince(started);
  Compare(task, score, progress, &outcome);
  return outcome;
}

}  // namespace

DesignOutcome RunDesignTask(const DesignTask& task, const Progress& progress) {
  if (const auto* gramian = std::get_if<GramianCriterion>(&task.criterion)) {
    return DesignByGramian(task, *gramian, progress);
  }
  return DesignByBound(task, std::get<BoundDesign>(task.criterion), progress);
}

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
  std::string text = fmt::format("score {:.4g} ({}), at its start {:.4g}; {} {} in {:.1f} s\n",
                                 r.score, ScoreMeaning(task), r.start_score, r.iterations,
                                 task.ByBound() ? "flights tried" : "iterations", r.seconds);
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
