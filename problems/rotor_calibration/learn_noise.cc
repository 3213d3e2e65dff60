#include "problems/rotor_calibration/learn_noise.h"

#include <array>
#include <cmath>
#include <limits>

#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr std::array<double RotorNoise::*, 6> kFigures = {
    &RotorNoise::force_density, &RotorNoise::angular_density, &RotorNoise::accel,
    &RotorNoise::gyro,          &RotorNoise::position,        &RotorNoise::attitude};
constexpr double kLastStep = 0.15;  // of the logarithm
constexpr double kRange = 100.0;
constexpr int kMostRuns = 150;

// `point`, where not null: gets where the filter was linearised, for runs with options nearby.
double LogLikelihood(const RotorAeroModel& model, const RotorData& data,
                     const RotorEkfOptions& options, RotorConstants* point = nullptr) {
  try {
    const RotorEkfRun run = RunRotorEkf(model, data, options);
    if (!std::isfinite(run.log_likelihood)) return -std::numeric_limits<double>::infinity();
    if (point != nullptr) *point = run.point;
    return run.log_likelihood;
  } catch (const InputError&) {  // it diverged: this noise does not fit
    return -std::numeric_limits<double>::infinity();
  }
}

}  // namespace

LearnedNoise LearnNoise(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options, const RotorNoise& stated,
                        double first_step) {
  RotorEkfOptions best = options;
  LearnedNoise learned;
  RotorConstants point = options.prior.mean;
  const double first = LogLikelihood(model, data, options, &point);
  best.point = point;
  double value = first;
  learned.runs = 1;
  std::array<double, 6> steps;
  steps.fill(first_step);
  bool open = true;
  while (open && learned.runs < kMostRuns) {
    open = false;
    for (std::size_t i = 0; i < kFigures.size(); ++i) {
      if (std::abs(steps[i]) < kLastStep) continue;
      open = true;
      RotorEkfOptions trial = best;
      double& figure = trial.noise.*kFigures[i];
      figure *= std::exp(steps[i]);
      const double ratio = figure / (stated.*kFigures[i]);
      const bool inside = ratio < kRange && ratio > 1.0 / kRange;
      const double likelihood = inside ? LogLikelihood(model, data, trial, &point)
                                       : -std::numeric_limits<double>::infinity();
      ++learned.runs;
      if (likelihood > value) {
        value = likelihood;
        best = trial;
        best.point = point;
      } else {
        steps[i] *= -0.5;
      }
    }
  }
  learned.noise = best.noise;
  learned.point = *best.point;
  learned.gain = value - first;
  return learned;
}

double LearnRotorDelay(const RotorAeroModel& model, const RotorData& data,
                       const RotorEkfOptions& options, double range) {
  const auto likelihood = [&](double delay) {
    RotorData shifted = data;
    for (double& t : shifted.speed_times) t += delay;
    return LogLikelihood(model, shifted, options);
  };
  constexpr double kFinest = 0.0025;  // s
  double best = 0.0, value = likelihood(0.0);
  for (double step = 0.5 * range; step >= kFinest; step *= 0.5) {
    const double centre = best;
    for (const double delay : {centre - step, centre + step}) {
      const double trial = likelihood(delay);
      if (trial > value) value = trial, best = delay;
    }
  }
  return best;
}

void LearnFromFlight(const RotorAeroModel& model, const FlightLog& log,
                     const RotorLearning& learning, RotorDataOptions* streams,
                     RotorEkfOptions* filter) {
  constexpr double kDelayRange = 0.04;  // s
  const auto some = [&] {
    RotorDataOptions part = *streams;
    part.duration = learning.seconds;
    return MakeRotorData(log, model.num_rotors(), part);
  };
  const auto learn = [&] {
    const LearnedNoise learned =
        LearnNoise(model, some(), *filter, learning.stated, learning.first_step);
    filter->noise = learned.noise;
    filter->point = learned.point;
  };
  if (learning.noise) learn();
  if (!learning.rotor_delay) return;
  streams->rotor_delay += LearnRotorDelay(model, some(), *filter, kDelayRange);
  if (learning.noise) learn();
}

}  // namespace trueline
