#include "problems/calibration/learn_rotor_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "problems/common/parallel.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr std::array<double RotorNoise::*, 8> kFigures = {
    &RotorNoise::force_density, &RotorNoise::angular_density,   &RotorNoise::accel,
    &RotorNoise::gyro,          &RotorNoise::position,          &RotorNoise::attitude,
    &RotorNoise::angular_drift, &RotorNoise::angular_drift_time};
constexpr double kLastStep = 0.15;  // of the logarithm, the search's last step
constexpr double kRange = 100.0;
constexpr int kMostRuns = 150;
constexpr double kFirstDrift = 3.0;  // rad/s^2, tried where there was none
constexpr double kDriftGain = 5.0;   // of log likelihood, below which there is none

// What the search tries for a figure. Without a drift its time constant changes nothing.
std::optional<double> NextTrial(const RotorNoise& at, double RotorNoise::*figure, double step) {
  const bool drifts = at.angular_drift > 0.0;
  if (!drifts && figure == &RotorNoise::angular_drift) return kFirstDrift;
  if (!drifts && figure == &RotorNoise::angular_drift_time) return std::nullopt;
  return at.*figure * std::exp(step);
}

// What the figure's factor of 100 counts from.
double ReferenceOf(const RotorNoise& stated, double RotorNoise::*figure) {
  return stated.*figure > 0.0 ? stated.*figure : kFirstDrift;
}

// Drops the drift if the flight hardly shows it.
void DropNeedlessDrift(const RotorAeroModel& model, const RotorData& data, const RotorNoise& stated,
                       RotorEkfOptions* best, RotorEkfRun* leader) {
  if (best->noise.angular_drift == 0.0 || stated.angular_drift > 0.0) return;
  RotorEkfOptions without = *best;
  without.noise.angular_drift = 0.0;
  without.rival = nullptr;
  RotorEkfRun run = RunOrDiverge(model, data, without);
  if (!(run.log_likelihood > leader->log_likelihood - kDriftGain)) return;
  *best = without;
  best->point = run.point;
  *leader = std::move(run);
}

using Steps = std::array<double, kFigures.size()>;

// Coordinate search: each figure in turn by its step, which is kept while it gains and else halved
// and reversed. Most trials gain nothing, so another core runs the next one under that assumption.
class NoiseSearch {
 public:
  NoiseSearch(const RotorAeroModel& model, const RotorData& data, const RotorEkfOptions& options,
              const RotorNoise& stated, double first_step)
      : model_(model), data_(data), stated_(stated), best_(options) {
    steps_.fill(first_step);
    leader_ = RunOrDiverge(model, data, options);
    first_ = leader_.log_likelihood;
    best_.point = std::isfinite(first_) ? leader_.point : options.prior.mean;
  }

  LearnedNoise Run() {
    std::optional<Trial> trial = NextFrom(0, steps_);
    while (trial && runs_ < kMostRuns) trial = Judge(std::move(*trial));
    DropNeedlessDrift(model_, data_, stated_, &best_, &leader_);
    return {best_.noise, *best_.point, leader_.log_likelihood - first_, runs_};
  }

 private:
  struct Trial {
    std::size_t figure;
    double value;
    std::optional<RotorEkfRun> run = std::nullopt;
  };

  // The first trial from this figure on, in a circle; none if all steps are small.
  std::optional<Trial> NextFrom(std::size_t figure, const Steps& steps) const {
    for (std::size_t k = 0; k < kFigures.size(); ++k) {
      const std::size_t i = (figure + k) % kFigures.size();
      if (std::abs(steps[i]) < kLastStep) continue;
      const std::optional<double> value = NextTrial(best_.noise, kFigures[i], steps[i]);
      if (value) return Trial{i, *value};
    }
    return std::nullopt;
  }

  // Takes the trial if it gains. Returns the next one.
  std::optional<Trial> Judge(Trial trial) {
    Steps without = steps_;
    without[trial.figure] *= -0.5;
    std::optional<Trial> next = NextFrom(trial.figure + 1, without);
    if (!trial.run) RunBoth(&trial, next && FreeCores() > 1 ? &*next : nullptr);
    ++runs_;
    if (!(trial.run->log_likelihood > leader_.log_likelihood)) {
      steps_ = without;
      return next;
    }
    best_.noise.*kFigures[trial.figure] = trial.value;
    best_.point = trial.run->point;
    leader_ = std::move(*trial.run);
    return NextFrom(trial.figure + 1, steps_);
  }

  void RunBoth(Trial* trial, Trial* next) const {
    Trial* const trials[] = {trial, next};
    ParallelFor(next == nullptr ? 1 : 2, 0, [&](int i) { trials[i]->run = RunOf(*trials[i]); });
  }

  // Linearised where the leading run was; stops once it falls far behind that.
  RotorEkfRun RunOf(const Trial& trial) const {
    const double ratio = trial.value / ReferenceOf(stated_, kFigures[trial.figure]);
    if (!(ratio < kRange && ratio > 1.0 / kRange)) {
      RotorEkfRun outside;
      outside.log_likelihood = -std::numeric_limits<double>::infinity();
      return outside;
    }
    RotorEkfOptions options = best_;
    options.noise.*kFigures[trial.figure] = trial.value;
    options.rival = leader_.likelihoods.empty() ? nullptr : &leader_.likelihoods;
    return RunOrDiverge(model_, data_, options);
  }

  const RotorAeroModel& model_;
  const RotorData& data_;
  const RotorNoise& stated_;
  RotorEkfOptions best_;
  RotorEkfRun leader_;
  double first_;
  Steps steps_;
  int runs_ = 1;
};

constexpr double kDelayRange = 0.04;  // s

// The delay of the greatest value, by steps that halve from half the range to `finest` or less; the
// last step by a parabola.
double Peak(const std::function<double(double)>& value, double centre, double range,
            double finest) {
  double best = centre, most = value(centre), step = 0.5 * range;
  for (;; step *= 0.5) {
    const double here = best;
    for (const double delay : {here - step, here + step}) {
      const double trial = value(delay);
      if (trial > most) most = trial, best = delay;
    }
    if (step <= finest) break;
  }
  const double before = value(best - step), after = value(best + step);
  return best + step * ParabolaVertex(before, most, after);
}

}  // namespace

LearnedNoise LearnRotorNoise(const RotorAeroModel& model, const RotorData& data,
                             const RotorEkfOptions& options, const RotorNoise& stated,
                             double first_step) {
  return NoiseSearch(model, data, options, stated, first_step).Run();
}

double LearnRotorDelay(const RotorAeroModel& model, const RotorData& data,
                       const RotorEkfOptions& options) {
  constexpr double kFinest = 0.0025;  // s
  const auto likelihood = [&](double delay) {
    RotorData shifted = data;
    for (double& t : shifted.speed_times) t += delay;
    return RunOrDiverge(model, shifted, options).log_likelihood;
  };
  return Peak(likelihood, 0.0, kDelayRange, kFinest);
}

double LearnGyroDelay(const RotorAeroModel& model, const FlightLog& log, const RotorData& data,
                      const RotorEkfOptions& options, double centre) {
  const double period = (data.imu.back().t - data.imu.front().t) /
                        std::max(1.0, static_cast<double>(data.imu.size()) - 1.0);
  const double range = period * std::exp2(std::ceil(std::log2(kDelayRange / period)));
  const auto likelihood = [&](double delay) {
    RotorData shifted = data;
    DelayGyro(log, delay, &shifted);
    return RunOrDiverge(model, shifted, options).log_likelihood;
  };
  return Peak(likelihood, period * std::round(centre / period), range, 1.5 * period);
}

void LearnFromFlight(const RotorAeroModel& model, const FlightLog& log,
                     const RotorLearning& learning, RotorDataOptions* streams,
                     RotorEkfOptions* filter) {
  const auto some = [&] {
    RotorDataOptions part = *streams;
    part.duration = learning.seconds;
    RotorData data = MakeRotorData(log, model.num_rotors(), part);
    streams->speeds = data.measured.model;
    return data;
  };
  const auto learn = [&] {
    const LearnedNoise learned =
        LearnRotorNoise(model, some(), *filter, learning.stated, learning.first_step);
    filter->noise = learned.noise;
    filter->point = learned.point;
  };
  if (learning.noise) learn();
  if (!learning.rotor_delay && !learning.gyro_delay) return;
  const RotorData data = some();
  if (learning.rotor_delay) {
    streams->rotor_delay += LearnRotorDelay(model, data, *filter);
  }
  if (learning.gyro_delay) {
    const RotorData shifted = learning.rotor_delay ? some() : data;
    streams->gyro_delay = LearnGyroDelay(model, log, shifted, *filter, streams->gyro_delay);
  }
  if (learning.noise) learn();
}

}  // namespace trueline
