#include "problems/observability/bound_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numeric>
#include <vector>

#include "cost_functions/numbers/taylor.h"
#include "problems/calibration/considered.h"
#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/random.h"
#include "problems/simulation/simulate_rotor_flight.h"

namespace trueline {
namespace {

using Eigen::VectorXd;

constexpr int kOffspring = 12;  // of a generation, evaluated in parallel

// Weights and rates as in Hansen's tutorial (table 1), those of the covariance raised by
// (n + 2) / 3 for its diagonal alone (Ros and Hansen, eq. 6).
struct EvolutionRates {
  EvolutionRates(int n, int parents) : weights(parents) {
    for (int i = 0; i < parents; ++i) weights[i] = std::log(parents + 0.5) - std::log(i + 1.0);
    weights /= weights.sum();
    mass = 1.0 / weights.squaredNorm();
    path = 4.0 / (n + 4.0);
    step_path = (mass + 2.0) / (n + mass + 3.0);
    const double diagonal = (n + 2.0) / 3.0;
    one = diagonal * 2.0 / (std::pow(n + 1.3, 2) + mass);
    rank = std::min(1.0 - one,
                    diagonal * 2.0 * (mass - 2.0 + 1.0 / mass) / (std::pow(n + 2, 2) + mass));
    walk = std::sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
  }
  VectorXd weights;
  double mass, path, step_path, one, rank;
  double walk;  // mean norm of n standard normal numbers
};

}  // namespace

Evolved Evolve(const std::function<double(const VectorXd&)>& cost, const VectorXd& start,
               const VectorXd& unit, const EvolveOptions& options) {
  const int n = static_cast<int>(start.size()), parents = kOffspring / 2;
  const EvolutionRates rates(n, parents);
  Random random(options.seed, "evolve");
  Evolved best{start, cost(start)};
  VectorXd mean = start, variance = unit.cwiseAbs2();
  VectorXd path = VectorXd::Zero(n), step_path = path;
  double step = options.step;
  for (int tried = 1; tried < options.evaluations; tried += kOffspring) {
    std::vector<VectorXd> moves(kOffspring, VectorXd(n));
    for (VectorXd& move : moves) {
      for (int j = 0; j < n; ++j) move[j] = std::sqrt(variance[j]) * random.Normal();
    }
    std::vector<double> values(kOffspring);
    ParallelFor(kOffspring, options.threads,
                [&](int i) { values[i] = cost(mean + step * moves[i]); });
    std::vector<int> order(kOffspring);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return values[a] < values[b]; });
    if (values[order[0]] < best.value) best = {mean + step * moves[order[0]], values[order[0]]};
    VectorXd shift = VectorXd::Zero(n), spread = VectorXd::Zero(n);
    for (int i = 0; i < parents; ++i) {
      shift += rates.weights[i] * moves[order[i]];
      spread += rates.weights[i] * moves[order[i]].cwiseAbs2();
    }
    mean += step * shift;
    const auto follow = [&](double rate) { return std::sqrt(rate * (2.0 - rate) * rates.mass); };
    step_path = (1.0 - rates.step_path) * step_path +
                follow(rates.step_path) * shift.cwiseQuotient(variance.cwiseSqrt());
    path = (1.0 - rates.path) * path + follow(rates.path) * shift;
    variance = (1.0 - rates.one - rates.rank) * variance + rates.one * path.cwiseAbs2() +
               rates.rank * spread;
    const double damping = 1.0 + rates.step_path;
    step *= std::exp(rates.step_path / damping * (step_path.norm() / rates.walk - 1.0));
    const int done = std::min(tried + kOffspring, options.evaluations);
    const bool tenth = 10 * done / options.evaluations > 10 * tried / options.evaluations;
    if (options.watch && tenth) options.watch(done, best.value);
  }
  return best;
}

namespace {

constexpr double kSlowest = 0.05, kFastest = 1.5;  // Hz
using MatchedSeries = Taylor<double, kMatchedDerivatives>;

double ToneOf(const Overtones& figure, int axis) {
  return std::clamp(std::abs(figure[axis * kToneUnknowns]), kSlowest, kFastest);
}

// c[0] + c[1] x + ...
MatchedSeries Polynomial(const MatchedSeries& x, std::initializer_list<double> c) {
  MatchedSeries sum(0.0), power(1.0);
  for (const double coefficient : c) {
    sum += MatchedSeries(coefficient) * power;
    power = power * x;
  }
  return sum;
}

// From 0 to 1 over x in [0, 1] with four derivatives of zero at both ends, and its integral.
MatchedSeries Step(const MatchedSeries& x) {
  return Polynomial(x, {0, 0, 0, 0, 0, 126, -420, 540, -315, 70});
}
MatchedSeries StepIntegral(const MatchedSeries& x) {
  return Polynomial(x, {0, 0, 0, 0, 0, 0, 21, -60, 67.5, -35, 7});
}

// The amplitude envelope about t (0 to 1), and its integral since the start.
struct Swell {
  MatchedSeries size, integral;
};
Swell SwellAt(const MatchedSeries& t, double duration, double ramp) {
  if (t[0] < ramp) {
    const MatchedSeries x = t / MatchedSeries(ramp);
    return {Step(x), MatchedSeries(ramp) * StepIntegral(x)};
  }
  if (t[0] > duration - ramp) {
    const MatchedSeries x = (MatchedSeries(duration) - t) / MatchedSeries(ramp);
    return {Step(x), MatchedSeries(duration - ramp) - MatchedSeries(ramp) * StepIntegral(x)};
  }
  return {MatchedSeries(1.0), t - MatchedSeries(0.5 * ramp)};
}

// Taylor coefficients at t.
FlatMatrix ExpandOvertones(const Overtones& figure, double t, double duration, double ramp) {
  const MatchedSeries time = MatchedSeries::Time(t);
  const Swell swell = SwellAt(time, duration, ramp);
  FlatMatrix c(kFlatOutputs, kMatchedDerivatives + 1);
  for (int i = 0; i < kFlatOutputs; ++i) {
    MatchedSeries sum(0.0);
    for (int tone = 1; tone <= kTones; ++tone) {
      const MatchedSeries angle = MatchedSeries(2.0 * M_PI * tone * ToneOf(figure, i)) * time;
      const auto parts = figure.segment<2>(i * kToneUnknowns + 2 * tone - 1);
      sum += MatchedSeries(parts[0]) * sin(angle) + MatchedSeries(parts[1]) * cos(angle);
    }
    sum = sum * swell.size;
    if (i == kFlatOutputs - 1) sum += MatchedSeries(figure[kOvertoneUnknowns - 1]) * swell.integral;
    for (int j = 0; j <= kMatchedDerivatives; ++j) c(i, j) = sum[j];
  }
  return c;
}

}  // namespace

Overtones OvertonesOf(const Lissajous& figure) {
  Overtones x = Overtones::Zero();
  for (int i = 0; i < kFlatOutputs; ++i) {
    x.segment<3>(i * kToneUnknowns) << figure.frequency[i],
        figure.amplitude[i] * std::cos(figure.phase[i]),
        figure.amplitude[i] * std::sin(figure.phase[i]);
  }
  return x;
}

Overtones OvertoneUnits(double size, double yaw_size) {
  constexpr double kFrequency = 0.3, kTurn = 3.0;  // Hz, rad/s
  Overtones unit;
  for (int i = 0; i < kFlatOutputs; ++i) {
    unit[i * kToneUnknowns] = kFrequency;
    for (int tone = 1; tone <= kTones; ++tone) {
      unit.segment<2>(i * kToneUnknowns + 2 * tone - 1)
          .setConstant((i < 3 ? size : yaw_size) / tone);
    }
  }
  unit[kOvertoneUnknowns - 1] = kTurn;
  return unit;
}

PiecewisePolynomial OvertonePath(const Overtones& figure, double duration, double ramp) {
  double fastest = 0.0;
  for (int i = 0; i < kFlatOutputs; ++i) fastest = std::max(fastest, ToneOf(figure, i));
  const int pieces = static_cast<int>(std::ceil(16.0 * std::max(0.25, fastest) * duration));
  return PiecewisePolynomial::FromExpansions(
      [&](double t) { return ExpandOvertones(figure, t, duration, ramp); }, duration, pieces);
}

namespace {

constexpr double kYawSize = 2.0;     // rad
constexpr double kLimitStep = 0.02;  // s, between checks of limits in the search

// `path` scaled up or down to its limits.
PiecewisePolynomial Scaled(const BoundDesign& design, const PiecewisePolynomial& path, double step,
                           double largest) {
  const RotorSimulation& sim = design.simulation;
  return ScaledToLimits(sim.vehicle, path, sim.limits, step, largest);
}

// The same with fewer samples, each as much better as keeps the information of a second: bounds
// differ little, and a flight costs a fraction.
BoundDesign WithCoarseSampling(BoundDesign design) {
  constexpr double kImuRate = 100.0, kPoseRate = 15.0;  // Hz; the controller needs the former
  RotorSimulation& sim = design.simulation;
  const double imu = std::sqrt(std::min(1.0, kImuRate / sim.imu_rate));
  const double pose = std::sqrt(std::min(1.0, kPoseRate / sim.pose_rate));
  sim.imu_rate *= imu * imu;
  sim.pose_rate *= pose * pose;
  sim.noise.accel *= imu;
  sim.noise.gyro *= imu;
  sim.noise.position *= pose;
  sim.noise.attitude *= pose;
  return design;
}

}  // namespace

std::vector<double> FlownSigmas(const BoundDesign& design, const PiecewisePolynomial& path) {
  constexpr double kLost = 0.1;  // m
  try {
    const RotorSimulation& sim = design.simulation;
    const Flown flown = Fly(sim, path, design.seed);
    if (flown.truth.path_error_rms > kLost) return {};
    const RotorAeroModel model = ModelOf(sim);
    RotorCalibrationOptions options(sim.vehicle);
    options.prior = design.prior;
    options.considered = design.considered;
    RotorBatchResult truth;
    truth.mean = flown.truth.constants;
    truth.nodes = flown.nodes;
    const RotorNormal normal(
        model, flown.data, {sim.noise, design.prior}, truth,
        VariantColumns(model, flown.data, ConsideredVariants(flown.log, options, {})),
        design.duration);
    const Eigen::MatrixXd cov = normal.NoiseCovariance() + normal.ColumnCovariance();
    const Eigen::VectorXd sigma = cov.diagonal().cwiseMax(0.0).cwiseSqrt();
    return {sigma.begin(), sigma.end()};
  } catch (const InputError&) {  // the vehicle departed from the path
    return {};
  }
}

double FlownBound(const BoundDesign& design, const PiecewisePolynomial& path) {
  const std::vector<double> sigma = FlownSigmas(design, path);
  if (sigma.empty()) return INFINITY;
  double sum = 0.0;
  for (const int i : design.show) sum += std::pow(sigma[i] / design.prior.sigma[i], 2);
  return sum / static_cast<double>(design.show.size());
}

DesignedFigure DesignFigure(const BoundDesign& design,
                            const std::function<void(const std::string&)>& progress) {
  const double size = 0.5 * design.simulation.limits.travel;
  const auto figure = [&](int i) {
    Random random(design.seed + i, "figure");
    return OvertonesOf(RandomFigure(size, kYawSize, &random));
  };
  const auto path = [&](const Overtones& x, double step = kLimitStep) {
    return Scaled(design, OvertonePath(x, design.duration, design.ramp), step, 2.0);
  };
  const BoundDesign sketch = WithCoarseSampling(design);
  const auto cost = [&](const Eigen::VectorXd& x) {
    return FlownBound(sketch, path(x, 2.0 * kLimitStep));
  };
  const auto whole_cost = [&](const Eigen::VectorXd& x) { return FlownBound(design, path(x)); };
  std::vector<double> bounds(design.candidates);
  ParallelFor(design.candidates, design.threads, [&](int i) { bounds[i] = cost(figure(i)); });
  const auto best = std::min_element(bounds.begin(), bounds.end()) - bounds.begin();
  if (!std::isfinite(bounds[best])) {
    throw InputError(fmt::format(
        "none of {} Lissajous figures can be flown within the limits; widen the limits or try more "
        "figures (candidates, best_of)",
        design.candidates));
  }
  const Overtones start = figure(static_cast<int>(best));
  Overtones x = start;
  if (design.evaluations > 0) {
    constexpr double kWhole = 0.2;  // share of the flights that the whole bound judges, at the end
    const int whole = static_cast<int>(kWhole * design.evaluations);
    const int rough = design.evaluations - whole;
    const auto watch = [&](int before) {
      return [&, before](int tried, double value) {
        progress(fmt::format("{} of {} flights, bound {:.1f} % of that of the best figure",
                             before + tried, design.evaluations,
                             100.0 * std::sqrt(value / bounds[best])));
      };
    };
    const Eigen::VectorXd units = OvertoneUnits(size, kYawSize);
    x = Evolve(cost, x, units, {rough, 0.1, design.seed, design.threads, watch(0)}).x;
    if (whole_cost(x) > whole_cost(start)) x = start;  // the sketch was wrong
    x = Evolve(whole_cost, x, units, {whole, 0.05, design.seed, design.threads, watch(rough)}).x;
  }
  const auto within_limits = [&](const Overtones& x) {
    return Scaled(design, path(x), 0.001, 1.0);
  };
  return {within_limits(x), FlownBound(design, within_limits(start))};
}

}  // namespace trueline
