#include "problems/trajectory/design_config.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/units.h"
#include "problems/observability/assessment.h"
#include "problems/observability/variational_gramian.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

std::vector<int> StatesNamed(const YamlMap& map, const std::string& key,
                             const std::vector<std::string>& names,
                             const std::vector<StateInfo>& info) {
  std::vector<int> states;
  for (const std::string& name : names) {
    const int state = FindState(info, name);
    if (state < 0 || info[state].moving) {
      map.Fail(key, fmt::format("'{}' is no parameter; use m, I_x ... I_z, r_BM_x ..., r_BP_x ..., "
                                "r_BI_x ..., b_a_x ..., b_w_x ..., k_f, k_m",
                                name));
    }
    if (std::count(states.begin(), states.end(), state) == 0) states.push_back(state);
  }
  return states;
}

int AtLeast(const YamlMap& map, const std::string& key, int fallback, int least) {
  const int value = map.Get<int>(key, fallback);
  if (value < least) map.Fail(key, fmt::format("must be at least {}", least));
  return value;
}

DesignOptions ReadOptions(const YamlMap& config) {
  DesignOptions options;
  options.shape.duration = config.Get<double>("duration", options.shape.duration);
  if (!(options.shape.duration >= 2.0 && options.shape.duration <= 120.0)) {
    config.Fail("duration", "must be in [2, 120] s");
  }
  const int pieces = std::max(10, static_cast<int>(std::lround(2.0 * options.shape.duration)));
  options.shape.pieces = AtLeast(config, "pieces", pieces, options.shape.degree + 1);
  options.limits = ReadLimits(config.ChildOrEmpty("limits"));
  options.candidates = AtLeast(config, "candidates", options.candidates, 1);
  options.starts = AtLeast(config, "starts", options.starts, 1);
  options.iterations = AtLeast(config, "iterations", options.iterations, 1);
  options.time_limit = config.Get<double>("time_limit", options.time_limit);
  return options;
}

// A Lissajous figure with its amplitude cut to the limits.
PiecewisePolynomial FeasibleFigure(const DesignTask& task, Random* random) {
  const Lissajous figure = RandomFigure(0.5 * task.options.limits.travel, 2.0, random);
  return ScaledToLimits(task.vehicle.model, task.vehicle.parameters,
                        LissajousPath(figure, task.options.shape.duration), task.options.limits,
                        0.02, 2.0);
}

std::vector<double> Scores(const DesignTask& task, const DesignTarget& target,
                           const std::string& stream,
                           const std::function<PiecewisePolynomial(Random*)>& draw) {
  std::vector<double> scores(task.compare);
  ParallelFor(task.compare, task.options.threads, [&](int i) {
    Random random(task.options.seed + 1000 + i, stream);
    scores[i] = FlightScore(task.system, task.vehicle.parameters, draw(&random), target);
  });
  std::sort(scores.begin(), scores.end());
  return scores;
}

double ExactScore(const DesignTask& task, const DesignTarget& target,
                  const PiecewisePolynomial& path) {
  const RotorFlight flight(task.vehicle.model, task.vehicle.parameters, path);
  const Eigen::MatrixXd gramian =
      VariationalGramian(task.system, flight.Nominal(), target.weights, 0.01);
  return ScoreStates(gramian, target.interest, target.asked, target.scale).sigma_min;
}

// The exact Gramian's bounds on the states of interest.
std::vector<double> Bounds(const DesignTask& task, const PiecewisePolynomial& path) {
  const RotorFlight flight(task.vehicle.model, task.vehicle.parameters, path);
  const Eigen::MatrixXd information =
      VariationalGramian(task.system, flight.Nominal(), task.system.OutputWeights(), 0.01);
  const Assessment assessment = Assess(information, task.target.asked, task.system.errors());
  std::vector<double> sigma;
  for (const int state : task.target.interest) {
    const auto at = std::find(task.target.asked.begin(), task.target.asked.end(), state);
    sigma.push_back(assessment.sigma[at - task.target.asked.begin()]);
  }
  return sigma;
}

double Median(const std::vector<double>& sorted) { return sorted[sorted.size() / 2]; }

std::string ScoreYaml(const DesignTask& task, const DesignOutcome& outcome) {
  const DesignResult& r = outcome.result;
  std::vector<std::string> names;
  names.reserve(task.target.interest.size());
  for (const int state : task.target.interest) names.push_back(task.system.errors()[state].name);
  std::string text = fmt::format(
      "provenance: {{version: {}, source: \"{}\", seed: {}}}\nshow: [{}]\n"
      "score: {:.6g}  # sigma_min of the scaled, marginalised E2LOG Gramian\n"
      "exact_score: {:.6g}  # by the exact Gramian\nstart_score: {:.6g}\nall_starts: [{:.6g}]\n"
      "iterations: {}\ntime_limited: {}\nseconds: {:.1f}\n",
      Version(), task.source, task.options.seed, fmt::join(names, ", "), r.score,
      outcome.exact_score, r.start_score, fmt::join(r.start_results, ", "), r.iterations,
      r.time_limited, r.seconds);
  text += fmt::format(
      "limits:  # on a grid of {} s\n  travel: {{used: {:.6g}, limit: {:.6g}, unit: m}}\n"
      "  rate: {{used: {:.6g}, limit: {:.6g}, unit: rad/s}}\n"
      "  tilt: {{used: {:.6g}, limit: {:.6g}, unit: rad}}\n"
      "  min_speed: {{used: {:.6g}, limit: {:.6g}, unit: rad/s}}\n"
      "  max_speed: {{used: {:.6g}, limit: {:.6g}, unit: rad/s}}\n",
      task.options.check_step, r.use.travel, task.options.limits.travel, r.use.rate,
      task.options.limits.rate, r.use.tilt, task.options.limits.tilt, r.use.min_speed,
      task.options.limits.min_speed, r.use.max_speed, task.options.limits.max_speed);
  text += "crlb_whole_flight:\n";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const StateInfo& info = task.system.errors()[task.target.interest[i]];
    text += fmt::format("  {}: {{value: {:.6g}, random: {:.6g}, unit: {}}}\n", names[i],
                        outcome.sigma[i], outcome.random_sigma[i], info.unit);
  }
  if (outcome.random_scores.empty()) return text;
  return text + fmt::format(
                    "compared:\n  random: {{count: {}, median: {:.6g}, best: {:.6g}}}\n"
                    "  lissajous: {{count: {}, median: {:.6g}, best: {:.6g}}}\n",
                    task.compare, Median(outcome.random_scores), outcome.random_scores.back(),
                    task.compare, Median(outcome.lissajous_scores),
                    outcome.lissajous_scores.back());
}

}  // namespace

DesignTask ReadDesignTask(const YamlMap& config, std::uint64_t seed, int threads) {
  const RotorVehicle vehicle =
      ReadRotorVehicle(config.Child("vehicle"), config.Get<double>("gravity", 9.81));
  const SensorSet noise = ReadSensorNoise(config.ChildOrEmpty("noise"));
  const auto sensors = config.Get<std::vector<std::string>>("sensors", {"imu", "pose"});
  RotorDrivenSystem system(vehicle.model, WithSensors(noise, sensors, config, "sensors"));
  DesignTask task{config.file(), vehicle, system, {}, ReadOptions(config)};
  task.options.seed = seed;
  task.options.threads = threads;
  task.target.interest =
      StatesNamed(config, "show", config.Get<std::vector<std::string>>("show"), system.errors());
  if (task.target.interest.empty()) config.Fail("show", "names nothing to show");
  task.target.asked = system.PaperStates();
  for (const int state : StatesNamed(
           config, "free", config.Get<std::vector<std::string>>("free", {}), system.errors())) {
    task.target.asked.push_back(state);
  }
  for (const int state : task.target.interest) {
    if (std::count(task.target.asked.begin(), task.target.asked.end(), state) == 0) {
      config.Fail("show", fmt::format("'{}' is taken as known; name it under 'free' too",
                                      system.errors()[state].name));
    }
  }
  task.target.weights = system.OutputWeights();
  if (config.GetChoice("weighting", {"noise", "none"}, "noise") == "none") {
    task.target.weights.assign(task.target.weights.size(), 1.0);
  }
  task.scale_flights = AtLeast(config, "scale_flights", task.scale_flights, 1);
  task.compare = AtLeast(config, "compare", 0, 0);
  config.Finish();
  return task;
}

DesignOutcome RunDesignTask(const DesignTask& task,
                            const std::function<void(const std::string&)>& progress) {
  const DesignOptions& options = task.options;
  const std::vector<double>& parameters = task.vehicle.parameters;
  progress(fmt::format("{} random flights for the scale of each state", task.scale_flights));
  DesignTarget target = task.target;
  target.scale =
      ScaleFromRandomFlights(task.system, parameters, target.asked, options.shape, options.limits,
                             task.scale_flights, options.seed, options.threads);
  progress(fmt::format("design from the best {} of {} random flights and figures", options.starts,
                       options.candidates));
  DesignOutcome outcome{
      DesignFlight(task.system, parameters, target, options), 0.0, target.scale, {}, {}, {}, {}};
  outcome.exact_score = ExactScore(task, target, outcome.result.path);
  outcome.sigma = Bounds(task, outcome.result.path);
  Random random(options.seed, "design");
  outcome.random_sigma = Bounds(task, RandomFeasibleFlight(task.vehicle.model, parameters,
                                                           options.shape, options.limits, &random));
  if (task.compare > 0) {
    progress(fmt::format("{} random flights and as many Lissajous figures", task.compare));
    outcome.random_scores = Scores(task, target, "compare", [&](Random* r) {
      return RandomFeasibleFlight(task.vehicle.model, parameters, options.shape, options.limits, r);
    });
    outcome.lissajous_scores =
        Scores(task, target, "lissajous", [&](Random* r) { return FeasibleFigure(task, r); });
  }
  return outcome;
}

void WriteDesign(const DesignTask& task, const DesignOutcome& outcome,
                 const std::filesystem::path& directory) {
  const RotorFlight flight(task.vehicle.model, task.vehicle.parameters, outcome.result.path);
  WriteFileAtomically(directory / "trajectory.yaml", TrajectoryYaml(outcome.result.path));
  WriteFileAtomically(directory / "trajectory.csv", TrajectoryCsv(flight, 100.0));
  WriteFileAtomically(directory / "score.yaml", ScoreYaml(task, outcome));
}

std::string DesignTable(const DesignTask& task, const DesignOutcome& outcome) {
  const DesignResult& r = outcome.result;
  const FlightLimits& limits = task.options.limits;
  std::string text =
      fmt::format("score {:.4g} (sigma_min), from {:.4g} of its start; {:.1f} s, {} iterations\n",
                  r.score, r.start_score, r.seconds, r.iterations);
  if (!outcome.random_scores.empty()) {
    text += fmt::format(
        "random flights ({0}): median {1:.4g}, best {2:.4g}; Lissajous figures ({0}): "
        "median {3:.4g}, best {4:.4g}\n",
        task.compare, Median(outcome.random_scores), outcome.random_scores.back(),
        Median(outcome.lissajous_scores), outcome.lissajous_scores.back());
  }
  text += fmt::format("score by the exact Gramian: {:.4g}\n", outcome.exact_score);
  text += fmt::format("\n{:<12} {:>12} {:>12}  unit\n", "parameter", "sigma", "random");
  for (std::size_t i = 0; i < outcome.sigma.size(); ++i) {
    const StateInfo& info = task.system.errors()[task.target.interest[i]];
    text += fmt::format("{:<12} {:>12.3e} {:>12.3e}  {}\n", info.name, outcome.sigma[i],
                        outcome.random_sigma[i], info.unit);
  }
  const auto row = [&](const char* name, double used, double limit, const char* unit) {
    text += fmt::format("{:<12} {:>12.4g} {:>12.4g}  {}\n", name, used, limit, unit);
  };
  text += fmt::format("\n{:<12} {:>12} {:>12}  unit\n", "limit", "used", "allowed");
  row("travel", r.use.travel, limits.travel, "m");
  row("body rate", r.use.rate, limits.rate, "rad/s");
  row("tilt", r.use.tilt * 180.0 / M_PI, limits.tilt * 180.0 / M_PI, "deg");
  row("slowest", r.use.min_speed / kRpm, limits.min_speed / kRpm, "rpm");
  row("fastest", r.use.max_speed / kRpm, limits.max_speed / kRpm, "rpm");
  return text;
}

}  // namespace trueline
