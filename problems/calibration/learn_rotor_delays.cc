#include "problems/calibration/learn_rotor_delays.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace trueline {
namespace {

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
  const double bend = before - 2.0 * most + after;
  if (!(bend < 0.0) || !std::isfinite(bend)) return best;
  return best + std::clamp(0.5 * step * (before - after) / bend, -step, step);
}

}  // namespace

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

}  // namespace trueline
