#include "problems/calibration/open_loop.h"

#include <algorithm>
#include <cmath>

#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

constexpr double kFirstStart = 1.0;  // s after the first pose

// `data` with the speeds of motors that have these constants.
RotorData DrivenBy(const RotorConstants& constants, const RotorData& data) {
  RotorData driven = data;
  if (driven.motors) driven.SimulateMotors(MotorsOf(constants));
  return driven;
}

// Of the filter that follows the flight with these constants.
RotorEkfOptions Following(const RotorConstants& calibrated, const RotorNoise& noise) {
  RotorEkfOptions options;
  options.noise = noise;
  options.prior.mean = calibrated;
  return options;
}

}  // namespace

std::vector<OpenLoopError> PredictOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                           const RotorNoise& noise,
                                           const RotorConstants& calibrated,
                                           const RotorConstants& constants,
                                           const std::vector<double>& horizons, double spacing) {
  const RotorEkfRun run =
      RunOrDiverge(model, DrivenBy(calibrated, data), Following(calibrated, noise));
  const RotorData driven = DrivenBy(constants, data);
  std::vector<OpenLoopError> errors;
  double next = data.poses.front().t + kFirstStart;
  for (const RotorEstimate& start : run.history) {
    if (start.t < next) continue;
    next = start.t + spacing;
    for (const double horizon : horizons) {
      const RotorPose* pose = PoseNear(data, start.t + horizon);
      if (pose == nullptr) continue;
      Eigen::Vector3d drift = start.node.drift;
      const RotorState end = Integrated(model, driven, noise, Joined(start.node.motion, constants),
                                        &drift, start.t, pose->t);
      errors.push_back({start.t, horizon, (SensedPosition(end) - pose->p_E).norm()});
    }
  }
  return errors;
}

std::vector<RotorForecast> ForecastOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                            const RotorNoise& noise,
                                            const RotorConstants& calibrated,
                                            const std::vector<double>& horizons, double spacing) {
  RotorEkfOptions options = Following(calibrated, noise);
  options.forecast = {horizons, spacing, kFirstStart};
  return RunOrDiverge(model, DrivenBy(calibrated, data), options).forecasts;
}

}  // namespace trueline
