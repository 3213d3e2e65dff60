#include "problems/experiment/rotor_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>

#include "problems/calibration/considered.h"
#include "problems/calibration/learn_rotor_noise.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/progress.h"
#include "problems/common/random.h"
#include "problems/common/yaml_archive.h"
#include "problems/experiment/job.h"
#include "problems/experiment/overlay.h"
#include "problems/experiment/rows.h"
#include "problems/observability/bound_design.h"
#include "problems/result/yaml_text.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "problems/trajectory/limits.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

FlightKindSource ReadKind(const YamlMap& map) {
  FlightKindSource source;
  source.name = ReadName(map, "name");
  source.kind = map.GetChoice("kind", {"random", "lissajous", "evolved", "file"}, "random");
  if (source.kind == "file") {
    source.file = ReadFilePath(map, "file").string();
  }
  if (source.kind == "evolved") {
    source.evaluations = 1800;
    YamlArchive(map).Count("evaluations", &source.evaluations);
  }
  if (source.kind == "lissajous" || source.kind == "evolved") {
    YamlArchive(map).Count("best_of", &source.best_of);
    for (const auto& name :
         map.Get<std::vector<std::string>>("by", {"r_BP_x", "r_BP_y", "r_BP_z"})) {
      source.by.push_back(FindRotorConstant(name));
      if (source.by.back() < 0) map.Fail("by", "'" + name + "' is no constant of this model");
    }
  }
  map.Finish();
  return source;
}

}  // namespace

bool IsRotorExperiment(const std::filesystem::path& file) {
  const YamlMap map = YamlMap::FromFile(file);
  return map.Has("drive") && map.Get<std::string>("drive") == "rotors";
}

RotorExperiment ReadRotorExperiment(const std::filesystem::path& file) {
  const YamlMap map = YamlMap::FromFile(file);
  map.GetChoice("drive", {"rotors"}, "rotors");
  RotorExperiment experiment(ReadRotorFlightVehicle(map));
  experiment.file = file.string();
  experiment.config = YAML::LoadFile(file.string());
  experiment.name = map.Get<std::string>("name");
  experiment.about = map.Get<std::string>("about", std::string());
  YamlArchive a(map);
  a.Positive("duration", &experiment.duration);
  a.Require(experiment.duration >= 2.0, "duration", "must be 2 s or more");
  a.Count("flights", &experiment.flights);
  a.Value("seed", &experiment.seed);
  a.Value("passes", &experiment.passes);
  a.Require(experiment.passes >= 0, "passes", "must be 0 or more");
  a.Value("learn_noise", &experiment.learn_noise);
  a.Value("learn_delays", &experiment.learn_delays);
  a.Value("widen", &experiment.widen);
  experiment.unmodelled = ReadConsidered(map.ChildOrEmpty("unmodelled"));
  experiment.considered = ReadConsidered(map.ChildOrEmpty("consider"));
  experiment.prior = PriorFromVehicle(experiment.simulation.vehicle);
  ReadRotorPrior(map.ChildOrEmpty("prior"), &experiment.prior);
  experiment.believed = experiment.simulation.noise;
  a.Nested("noise", &experiment.believed);
  for (const YamlMap& kind : map.Children("kinds")) experiment.kinds.push_back(ReadKind(kind));
  if (experiment.kinds.empty()) map.Fail("kinds", "names no kind of flight");
  std::set<std::string> names;
  for (const FlightKindSource& kind : experiment.kinds) {
    if (!names.insert(kind.name).second) map.Fail("kinds", "'" + kind.name + "' is named twice");
  }
  map.Finish();
  return experiment;
}

void ShortenRotorExperiment(RotorExperiment* experiment) {
  experiment->flights = 2;
  experiment->duration = 5.0;
  experiment->learn_noise = false;
  for (FlightKindSource& kind : experiment->kinds) {
    kind.best_of = 3;
    kind.evaluations = std::min(kind.evaluations, 24);
  }
}

namespace {

double Nees(const Eigen::MatrixXd& cov, const RotorConstants& error, const std::vector<int>& free) {
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd scaled(n);
  Eigen::MatrixXd correlation(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    scaled[i] = error[free[i]] / std::sqrt(cov(free[i], free[i]));
    for (Eigen::Index j = 0; j < n; ++j) {
      correlation(i, j) =
          cov(free[i], free[j]) / std::sqrt(cov(free[i], free[i]) * cov(free[j], free[j]));
    }
  }
  return scaled.dot(correlation.ldlt().solve(scaled)) / static_cast<double>(n);
}

PiecewisePolynomial RandomPath(const RotorExperiment& experiment, std::uint64_t seed) {
  return RandomFeasibleFlight(experiment.simulation.vehicle, experiment.duration,
                              experiment.simulation.limits, seed);
}

// The simulation with effects that the estimators do not model, of sizes drawn for this flight.
// Drag and lag are drawn with one sign.
RotorSimulation DrawUnmodelled(const RotorExperiment& experiment, std::uint64_t seed) {
  RotorSimulation drawn = experiment.simulation;
  Random random(seed, "unmodelled");
  std::map<std::string, std::map<std::string, double>> values;
  for (const ConsideredEffect& e : experiment.unmodelled) {
    if (e.id == "rotor_loss") {
      for (int i = 0; i < drawn.vehicle.model.num_rotors(); ++i) {
        const double factor = 1.0 + e.sigma * random.Normal();
        drawn.effects.push_back({e.id, {{"rotor", i}, {"factor", factor}}});
      }
      continue;
    }
    double size = e.sigma * random.Normal();
    if (e.id == "linear_drag") size = -std::abs(size);
    if (e.id == "motor_lag") {
      constexpr double kQuickest = 0.002;  // s, smallest lag drawn; real motors are slower
      size = std::max(kQuickest, std::abs(size));
      drawn.log_commands = true;
    }
    values[e.id][e.parameter] = size;
  }
  for (auto& [id, parameters] : values) {
    for (const std::string& name : ConsiderableParameters(id)) parameters.try_emplace(name, 0.0);
    drawn.effects.push_back({id, parameters});
  }
  return drawn;
}

// Covariance that the considered effects add to those of filter and batch.
Eigen::MatrixXd Considered(const RotorExperiment& experiment, const Flown& flown,
                           const RotorBatchOptions& batch, const RotorBatchResult& fit) {
  RotorCalibrationOptions options(experiment.simulation.vehicle);
  options.prior = batch.prior;
  options.considered = experiment.considered;
  return ConsideredCovariance(ModelOf(experiment.simulation), flown.data, batch, fit,
                              ConsideredVariants(flown.log, options, {}));
}

TrialRow::Estimate EstimateOf(const RotorConstants& error, const Eigen::MatrixXd& cov) {
  return {error, cov.diagonal().cwiseMax(0.0).cwiseSqrt()};
}

Eigen::MatrixXd ConstantsOf(const RotorEkfRun& run) {
  constexpr int kConstants = RotorAeroModel::kConstants;
  return run.cov.bottomRightCorner<kConstants, kConstants>();
}

TrialRow::Estimate RunOrdinaryFilter(const RotorAeroModel& model, const Flown& flown,
                                     RotorEkfOptions options, const Eigen::MatrixXd& considered) {
  options.passes = 0;
  try {
    const RotorEkfRun run = RunRotorEkf(model, flown.data, options);
    return EstimateOf(run.history.back().mean - flown.truth.constants,
                      ConstantsOf(run) + considered);
  } catch (const InputError&) {  // it diverged
    const RotorConstants none = RotorConstants::Constant(std::numeric_limits<double>::quiet_NaN());
    return {none, none};
  }
}

// Inputs of a kind's flights except the seed, and of its path.
std::string DescriptionOf(const RotorExperiment& experiment, const FlightKindSource& kind) {
  return fmt::format("{}{} {} {} {} {} {} {} {}\n", TextOf(experiment.config), experiment.duration,
                     experiment.seed, experiment.learn_noise, kind.name, kind.kind, kind.best_of,
                     kind.evaluations, kind.file.empty() ? "" : Sha256OfFile(kind.file));
}

// The path that all flights of a kind share, if they do.
std::optional<PiecewisePolynomial> SamePath(const RotorExperiment& experiment,
                                            const FlightKindSource& kind, int threads, bool quiet) {
  if (kind.kind == "random") return std::nullopt;
  if (kind.kind == "file") return ReadTrajectoryFile(kind.file);
  return DesignFigure(
             {experiment.simulation, experiment.prior, experiment.considered, kind.by,
              experiment.duration, 0.0, kind.best_of, kind.evaluations, experiment.seed, threads},
             [&](const std::string& what) { Announce(what, quiet); })
      .path;
}

// Takes what the log states about rotor speeds and gyroscope at other times, as learned from it.
void LearnDelays(const RotorExperiment& experiment, const RotorEkfOptions& filter, Flown* flown) {
  if (!experiment.learn_delays) return;
  const RotorAeroModel model = ModelOf(experiment.simulation);
  RotorDataOptions streams;
  RotorEkfOptions same = filter;
  LearnFromFlight(model, flown->log, {false, true, true}, &streams, &same);
  flown->data = MakeRotorData(flown->log, model.num_rotors(), streams);
}

RotorNoise NoiseFor(const RotorExperiment& experiment, const PiecewisePolynomial& path) {
  if (!experiment.learn_noise) return experiment.believed;
  const Flown flown = Fly(DrawUnmodelled(experiment, experiment.seed), path, experiment.seed);
  RotorEkfOptions options;
  options.noise = experiment.believed;
  options.prior = DrawGuess(experiment.prior, flown.truth.constants, experiment.seed);
  RotorLearning learning{true, experiment.learn_delays, experiment.learn_delays};
  learning.seconds = 0.0;  // all of it
  learning.stated = experiment.believed;
  RotorDataOptions streams;
  LearnFromFlight(ModelOf(experiment.simulation), flown.log, learning, &streams, &options);
  return options.noise;
}

// Result of the work before a kind's flights, as it is stored: noise and, of a shared path, path.
std::string Prepare(const RotorExperiment& experiment, const FlightKindSource& kind, int threads,
                    bool quiet) {
  const auto path = SamePath(experiment, kind, threads, quiet);
  YAML::Node prepared;
  prepared["noise"] =
      ToYaml(NoiseFor(experiment, path ? *path : RandomPath(experiment, experiment.seed)));
  if (path) prepared["path"] = YAML::Load(TrajectoryYaml(*path));
  return TextOf(prepared);
}

void AddJobs(const RotorExperiment& experiment, const FlightKindSource& source,
             const std::filesystem::path& folder, int threads, bool quiet, std::vector<Job>* jobs) {
  Announce(source.name, quiet);
  const std::string description = DescriptionOf(experiment, source);
  const std::string text = ReuseOrMake(folder, KeyOf(description), [&] {
                             return Prepare(experiment, source, threads, quiet);
                           }).text;
  const YamlMap prepared(YAML::Load(text), source.name, "");
  RotorFlightKind ready{experiment, std::nullopt, FromYaml<RotorNoise>(prepared.Child("noise"))};
  if (prepared.Has("path")) ready.path = TrajectoryOf(prepared.Child("path"));
  const auto kind = std::make_shared<const RotorFlightKind>(std::move(ready));
  for (int i = 0; i < experiment.flights; ++i) {
    Job job;
    job.log = source.name;
    job.seed = experiment.seed + static_cast<std::uint64_t>(i);
    job.flight = kind;
    job.key = KeyOf(fmt::format("{}{}", description, job.seed));
    jobs->push_back(std::move(job));
  }
}

}  // namespace

TrialRow FlyTrial(const RotorFlightKind& kind, std::uint64_t seed) {
  const RotorExperiment& experiment = kind.experiment;
  TrialRow trial;
  const RotorAeroModel model = ModelOf(experiment.simulation);
  Flown flown = Fly(DrawUnmodelled(experiment, seed),
                    kind.path ? *kind.path : RandomPath(experiment, seed), seed);
  const RotorPrior prior = DrawGuess(experiment.prior, flown.truth.constants, seed);
  trial.path_error = flown.truth.path_error_rms;
  trial.first_guess = prior.mean - flown.truth.constants;
  const RotorConstants& truth = flown.truth.constants;
  RotorEkfOptions filter_options{kind.noise, prior};
  LearnDelays(experiment, filter_options, &flown);
  filter_options.passes = experiment.passes;
  const RotorEkfRun filter = RunRotorEkf(model, flown.data, filter_options);
  constexpr std::size_t kEvery = 6;  // every sixth pose: about 0.2 s
  for (std::size_t i = 0; i < filter.history.size(); i += kEvery) {
    const RotorEstimate& estimate = filter.history[i];
    trial.history.push_back({estimate.t, {estimate.mean - truth, estimate.sigma}});
  }
  RotorBatchOptions options{kind.noise, prior};
  options.widen = experiment.widen;
  const RotorBatchResult batch =
      WithoutSpeedNoiseBias(model, flown.data, options, RunRotorBatch(model, flown.data, options));
  if (!batch.converged) throw InputError("the batch did not converge");
  const Eigen::MatrixXd considered = Considered(experiment, flown, options, batch);
  trial.ordinary = RunOrdinaryFilter(model, flown, {kind.noise, prior}, considered);
  const Eigen::MatrixXd batch_cov = batch.cov + considered;
  trial.batch = EstimateOf(batch.mean - truth, batch_cov);
  trial.batch_nees = Nees(batch_cov, trial.batch.error, prior.Free());
  const Eigen::MatrixXd filter_cov = ConstantsOf(filter) + considered;
  trial.filter = EstimateOf(filter.history.back().mean - truth, filter_cov);
  trial.filter_nees = Nees(filter_cov, trial.filter.error, prior.Free());
  trial.bound =
      RotorBound(model, flown.data, {experiment.simulation.noise, prior}, flown.nodes, truth)
          .diagonal()
          .cwiseSqrt();
  return trial;
}

std::vector<Job> MakeRotorJobs(const RotorExperiment& experiment,
                               const std::filesystem::path& jobs_folder, int threads, bool quiet) {
  std::vector<Job> jobs;
  for (const FlightKindSource& kind : experiment.kinds) {
    AddJobs(experiment, kind, jobs_folder, threads, quiet, &jobs);
  }
  return jobs;
}

}  // namespace trueline
