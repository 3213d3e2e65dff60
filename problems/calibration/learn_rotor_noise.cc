#include "problems/calibration/learn_rotor_noise.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "problems/calibration/learn_rotor_delays.h"

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

// Without a drift that the flight hardly shows.
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

}  // namespace

LearnedNoise LearnRotorNoise(const RotorAeroModel& model, const RotorData& data,
                             const RotorEkfOptions& options, const RotorNoise& stated,
                             double first_step) {
  RotorEkfOptions best = options;
  LearnedNoise learned;
  RotorEkfRun leader = RunOrDiverge(model, data, options);
  const double first = leader.log_likelihood;
  best.point = std::isfinite(first) ? leader.point : options.prior.mean;
  learned.runs = 1;
  std::array<double, kFigures.size()> steps;
  steps.fill(first_step);
  bool open = true;
  while (open && learned.runs < kMostRuns) {
    open = false;
    for (std::size_t i = 0; i < kFigures.size(); ++i) {
      if (std::abs(steps[i]) < kLastStep) continue;
      RotorEkfOptions trial = best;
      const std::optional<double> figure = NextTrial(best.noise, kFigures[i], steps[i]);
      if (!figure) continue;
      open = true;
      trial.noise.*kFigures[i] = *figure;
      const double ratio = *figure / ReferenceOf(stated, kFigures[i]);
      const bool inside = ratio < kRange && ratio > 1.0 / kRange;
      ++learned.runs;
      // Runs are linearised where the leading run was, and stop once they fall far behind it.
      trial.rival = leader.likelihoods.empty() ? nullptr : &leader.likelihoods;
      RotorEkfRun run;
      if (inside) run = RunOrDiverge(model, data, trial);
      if (inside && run.log_likelihood > leader.log_likelihood) {
        trial.rival = nullptr;
        best = trial;
        best.point = run.point;
        leader = std::move(run);
      } else {
        steps[i] *= -0.5;
      }
    }
  }
  DropNeedlessDrift(model, data, stated, &best, &leader);
  learned.noise = best.noise;
  learned.point = *best.point;
  learned.gain = leader.log_likelihood - first;
  return learned;
}

void LearnFromFlight(const RotorAeroModel& model, const FlightLog& log,
                     const RotorLearning& learning, RotorDataOptions* streams,
                     RotorEkfOptions* filter) {
  const auto some = [&] {
    RotorDataOptions part = *streams;
    part.duration = learning.seconds;
    return MakeRotorData(log, model.num_rotors(), part);
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
