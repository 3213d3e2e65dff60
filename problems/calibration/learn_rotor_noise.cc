#include "problems/calibration/learn_rotor_noise.h"

#include <array>
#include <cmath>
#include <limits>

#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr std::array<double RotorNoise::*, 6> kFigures = {
    &RotorNoise::force_density, &RotorNoise::angular_density, &RotorNoise::accel,
    &RotorNoise::gyro,          &RotorNoise::position,        &RotorNoise::attitude};
constexpr double kLastStep = 0.15;  // of the logarithm, the search's last step
constexpr double kRange = 100.0;
constexpr int kMostRuns = 150;

// A run whose filter diverges gets the log likelihood minus infinity.
RotorEkfRun Run(const RotorAeroModel& model, const RotorData& data,
                const RotorEkfOptions& options) {
  RotorEkfRun run;
  try {
    run = RunRotorEkf(model, data, options);
  } catch (const InputError&) {
    run.log_likelihood = std::numeric_limits<double>::quiet_NaN();
  }
  if (!std::isfinite(run.log_likelihood)) {
    run.log_likelihood = -std::numeric_limits<double>::infinity();
  }
  return run;
}

}  // namespace

LearnedNoise LearnRotorNoise(const RotorAeroModel& model, const RotorData& data,
                             const RotorEkfOptions& options, const RotorNoise& stated,
                             double first_step) {
  RotorEkfOptions best = options;
  LearnedNoise learned;
  RotorEkfRun leader = Run(model, data, options);
  const double first = leader.log_likelihood;
  best.point = std::isfinite(first) ? leader.point : options.prior.mean;
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
      ++learned.runs;
      // Runs are linearised where the leading run was, and stop once they fall far behind it.
      trial.rival = leader.likelihoods.empty() ? nullptr : &leader.likelihoods;
      RotorEkfRun run;
      if (inside) run = Run(model, data, trial);
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
  learned.noise = best.noise;
  learned.point = *best.point;
  learned.gain = leader.log_likelihood - first;
  return learned;
}

double LearnRotorDelay(const RotorAeroModel& model, const RotorData& data,
                       const RotorEkfOptions& options, double range) {
  const auto likelihood = [&](double delay) {
    RotorData shifted = data;
    for (double& t : shifted.speed_times) t += delay;
    return Run(model, shifted, options).log_likelihood;
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
        LearnRotorNoise(model, some(), *filter, learning.stated, learning.first_step);
    filter->noise = learned.noise;
    filter->point = learned.point;
  };
  if (learning.noise) learn();
  if (!learning.rotor_delay) return;
  streams->rotor_delay += LearnRotorDelay(model, some(), *filter, kDelayRange);
  if (learning.noise) learn();
}

}  // namespace trueline
