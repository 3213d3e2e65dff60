#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "problems/calibration/considered.h"
#include "problems/calibration/learn_noise.h"
#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/random.h"
#include "problems/design/bound_design.h"
#include "problems/experiment/rotor_experiment.h"
#include "problems/rotor_simulation/flown.h"
#include "problems/trajectory/feasible_flight.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

using Report = std::function<void(const std::string&)>;

// Draws an initial guess from the prior, limited to physical bodies.
RotorPrior DrawGuess(const RotorPrior& prior, const RotorConstants& truth, std::uint64_t seed) {
  RotorPrior drawn = prior;
  Random random(seed, "first guess");
  const int inertia = FindRotorConstant("I_x");
  do {
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      drawn.mean[i] = truth[i] + prior.sigma[i] * random.Normal();
    }
  } while (!IsPhysicalInertia(drawn.mean.segment<3>(inertia)) || !(drawn.mean[0] > 0.0));
  return drawn;
}

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
  const RotorSimulation& sim = experiment.simulation;
  SplineShape shape;
  shape.duration = experiment.duration;
  shape.pieces = std::max(10, static_cast<int>(std::lround(2.0 * experiment.duration)));
  Random random(seed, "trajectory");
  return RandomFeasibleFlight(sim.vehicle.model, sim.vehicle.parameters, shape, sim.limits,
                              &random);
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

RotorEkfRun RunFilter(const RotorAeroModel& model, const Flown& flown, const RotorNoise& noise,
                      const RotorPrior& prior, RotorTrial* trial) {
  RotorEkfRun run = RunRotorEkf(model, flown.data, {noise, prior});
  trial->history = run.history;
  for (RotorEstimate& estimate : trial->history) estimate.mean -= flown.truth.constants;
  trial->filter_error = trial->history.back().mean;
  return run;
}

RotorTrial RunTrial(const RotorExperiment& experiment, const PiecewisePolynomial& path,
                    const RotorNoise& noise, std::uint64_t seed) {
  RotorTrial trial;
  trial.seed = seed;
  try {
    const RotorAeroModel model = ModelOf(experiment.simulation);
    const Flown flown = Fly(DrawUnmodelled(experiment, seed), path, seed);
    const RotorPrior prior = DrawGuess(experiment.prior, flown.truth.constants, seed);
    trial.path_error = flown.truth.path_error_rms;
    trial.first_guess = prior.mean - flown.truth.constants;
    const RotorEkfRun filter = RunFilter(model, flown, noise, prior, &trial);
    RotorBatchOptions options{noise, prior};
    options.widen = experiment.widen;
    const RotorBatchResult batch = RunRotorBatch(model, flown.data, options);
    trial.batch_error = batch.mean - flown.truth.constants;
    const Eigen::MatrixXd considered = Considered(experiment, flown, options, batch);
    const Eigen::MatrixXd batch_cov = batch.cov + considered;
    trial.batch_sigma = batch_cov.diagonal().cwiseMax(0.0).cwiseSqrt();
    trial.batch_nees = Nees(batch_cov, trial.batch_error, prior.Free());
    constexpr int kConstants = RotorAeroModel::kConstants;
    const Eigen::MatrixXd filter_cov =
        filter.cov.bottomRightCorner<kConstants, kConstants>() + considered;
    trial.filter_sigma = filter_cov.diagonal().cwiseMax(0.0).cwiseSqrt();
    trial.filter_nees = Nees(filter_cov, trial.filter_error, prior.Free());
    trial.bound = RotorBound(model, flown.data, {experiment.simulation.noise, prior}, flown.nodes,
                             flown.truth.constants)
                      .diagonal()
                      .cwiseSqrt();
    if (!batch.converged) trial.failure = "the batch did not converge";
  } catch (const InputError& error) {
    trial.failure = error.what();
  }
  return trial;
}

// The path that all flights of a kind share, if they do.
std::optional<PiecewisePolynomial> SamePath(const RotorExperiment& experiment,
                                            const FlightKindSource& kind, int threads,
                                            const Report& progress) {
  if (kind.kind == "random") return std::nullopt;
  if (kind.kind == "file") return ReadTrajectoryFile(kind.file);
  return DesignFigure(
             {experiment.simulation, experiment.prior, experiment.considered, kind.by,
              experiment.duration, 0.0, kind.best_of, kind.evaluations, experiment.seed, threads},
             progress)
      .path;
}

RotorNoise NoiseFor(const RotorExperiment& experiment, const PiecewisePolynomial& path) {
  if (!experiment.learn_noise) return experiment.believed;
  const Flown flown = Fly(DrawUnmodelled(experiment, experiment.seed), path, experiment.seed);
  RotorEkfOptions options;
  options.noise = experiment.believed;
  options.prior = DrawGuess(experiment.prior, flown.truth.constants, experiment.seed);
  return LearnNoise(ModelOf(experiment.simulation), flown.data, options, experiment.believed).noise;
}

}  // namespace

RotorExperimentRun RunRotorExperiment(const RotorExperiment& experiment, int threads,
                                      const Report& progress) {
  RotorExperimentRun run;
  for (std::size_t k = 0; k < experiment.kinds.size(); ++k) {
    const FlightKindSource& kind = experiment.kinds[k];
    progress(kind.name);
    const auto one = SamePath(experiment, kind, threads, progress);
    const auto path = [&](int i) {
      return one ? *one : RandomPath(experiment, experiment.seed + i);
    };
    const RotorNoise noise = NoiseFor(experiment, path(0));
    std::vector<RotorTrial> flown(experiment.flights);
    ParallelFor(experiment.flights, threads, [&](int i) {
      flown[i] = RunTrial(experiment, path(i), noise, experiment.seed + i);
      flown[i].kind = static_cast<int>(k);
    });
    for (RotorTrial& trial : flown) run.trials.push_back(std::move(trial));
    run.paths.push_back(one);
  }
  return run;
}

}  // namespace trueline
