#include <fmt/format.h>

#include <cmath>

#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/random.h"
#include "problems/rotor_calibration/learn_noise.h"
#include "problems/rotor_experiment/rotor_experiment.h"
#include "problems/trajectory/design.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

using Progress = std::function<void(const std::string&)>;

// Initial guesses as the prior has them, kept to bodies that can exist.
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

struct Flown {
  RotorTruth truth;
  RotorData data;
  std::vector<RotorNode> nodes;  // the truth at each pose
};

Flown Fly(const RotorExperiment& experiment, const PiecewisePolynomial& path, std::uint64_t seed) {
  Flown flown;
  const RotorSimulation& sim = experiment.simulation;
  const FlightLog log = SimulateRotorFlight(sim, path, seed, &flown.truth);
  flown.data = MakeRotorData(log, sim.vehicle.model.num_rotors(), {});
  for (const RotorPose& pose : flown.data.poses) {
    flown.nodes.push_back(flown.truth.states[std::lround(pose.t * sim.imu_rate)]);
  }
  return flown;
}

RotorAeroModel ModelOf(const RotorExperiment& experiment) {
  const RotorDrivenModel& model = experiment.simulation.vehicle.model;
  return RotorAeroModel(model.rotors(), model.gravity());
}

// Mean variance bound of the constants asked for, in units of the prior; infinite for a figure that
// can't be flown within 0.1 m.
double FigureScore(const RotorExperiment& experiment, const FlightKindSource& kind,
                   const PiecewisePolynomial& path) {
  try {
    const Flown flown = Fly(experiment, path, experiment.seed);
    if (flown.truth.path_error_rms > 0.1) return INFINITY;
    const RotorBatchOptions options{experiment.simulation.noise, experiment.prior};
    const Eigen::MatrixXd cov =
        RotorBound(ModelOf(experiment), flown.data, options, flown.nodes, flown.truth.constants);
    double sum = 0.0;
    for (const int i : kind.by) sum += cov(i, i) / std::pow(experiment.prior.sigma[i], 2);
    return sum;
  } catch (const InputError&) {  // the vehicle lost it
    return INFINITY;
  }
}

PiecewisePolynomial BestFigure(const RotorExperiment& experiment, const FlightKindSource& kind,
                               int threads) {
  const RotorSimulation& sim = experiment.simulation;
  const auto path = [&](int i) {
    Random random(experiment.seed + i, "figure");
    const Lissajous figure = RandomFigure(0.5 * sim.limits.travel, 2.0, &random);
    return ScaledToLimits(sim.vehicle.model, sim.vehicle.parameters,
                          LissajousPath(figure, experiment.duration), sim.limits, 0.02, 2.0);
  };
  std::vector<double> scores(kind.best_of);
  ParallelFor(kind.best_of, threads,
              [&](int i) { scores[i] = FigureScore(experiment, kind, path(i)); });
  const auto best = std::min_element(scores.begin(), scores.end()) - scores.begin();
  if (!std::isfinite(scores[best])) {
    throw InputError(kind.name + ": none of the figures can be flown; raise best_of");
  }
  return path(static_cast<int>(best));
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

void RunFilter(const RotorAeroModel& model, const Flown& flown, const RotorNoise& noise,
               const RotorPrior& prior, RotorTrial* trial) {
  const RotorEkfRun run = RunRotorEkf(model, flown.data, {noise, prior});
  trial->history = run.history;
  for (RotorEstimate& estimate : trial->history) estimate.mean -= flown.truth.constants;
  trial->filter_error = trial->history.back().mean;
  trial->filter_sigma = trial->history.back().sigma;
  constexpr int kConstants = RotorAeroModel::kConstants;
  trial->filter_nees =
      Nees(run.cov.bottomRightCorner<kConstants, kConstants>(), trial->filter_error, prior.Free());
}

RotorTrial RunTrial(const RotorExperiment& experiment, const PiecewisePolynomial& path,
                    const RotorNoise& noise, std::uint64_t seed) {
  RotorTrial trial;
  trial.seed = seed;
  try {
    const RotorAeroModel model = ModelOf(experiment);
    const Flown flown = Fly(experiment, path, seed);
    const RotorPrior prior = DrawGuess(experiment.prior, flown.truth.constants, seed);
    trial.path_error = flown.truth.path_error_rms;
    trial.first_guess = prior.mean - flown.truth.constants;
    RunFilter(model, flown, noise, prior, &trial);
    RotorBatchOptions options{noise, prior};
    options.widen = experiment.widen;
    const RotorBatchResult batch = RunRotorBatch(model, flown.data, options);
    trial.batch_error = batch.mean - flown.truth.constants;
    trial.batch_sigma = batch.Sigma();
    trial.batch_nees = Nees(batch.cov, trial.batch_error, prior.Free());
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

RotorNoise NoiseFor(const RotorExperiment& experiment, const PiecewisePolynomial& path) {
  if (!experiment.learn_noise) return experiment.believed;
  const Flown flown = Fly(experiment, path, experiment.seed);
  RotorEkfOptions options;
  options.noise = experiment.believed;
  options.prior = DrawGuess(experiment.prior, flown.truth.constants, experiment.seed);
  return LearnNoise(ModelOf(experiment), flown.data, options, experiment.believed).noise;
}

}  // namespace

std::vector<RotorTrial> RunRotorExperiment(const RotorExperiment& experiment, int threads,
                                           const Progress& progress) {
  std::vector<RotorTrial> trials;
  for (std::size_t k = 0; k < experiment.kinds.size(); ++k) {
    const FlightKindSource& kind = experiment.kinds[k];
    progress(kind.name);
    std::vector<PiecewisePolynomial> one;  // the same for all flights of the kind
    if (kind.kind == "file") one.push_back(ReadTrajectoryFile(kind.file));
    if (kind.kind == "lissajous") one.push_back(BestFigure(experiment, kind, threads));
    const auto path = [&](int i) {
      return one.empty() ? RandomPath(experiment, experiment.seed + i) : one.front();
    };
    const RotorNoise noise = NoiseFor(experiment, path(0));
    std::vector<RotorTrial> flown(experiment.flights);
    ParallelFor(experiment.flights, threads, [&](int i) {
      flown[i] = RunTrial(experiment, path(i), noise, experiment.seed + i);
      flown[i].kind = static_cast<int>(k);
    });
    for (RotorTrial& trial : flown) trials.push_back(std::move(trial));
  }
  return trials;
}

}  // namespace trueline
