#include "problems/calibration/open_loop.h"

#include <algorithm>
#include <cmath>

#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

constexpr double kStep = 0.004;      // s
constexpr double kFirstStart = 1.0;  // s after the first pose

// `data` with the speeds of motors that have these constants.
RotorData DrivenBy(const RotorConstants& constants, const RotorData& data) {
  RotorData driven = data;
  if (driven.motors) driven.TurnMotors(MotorsOf(constants));
  return driven;
}

RotorState Integrate(const RotorAeroModel& model, const RotorData& data, RotorState x, double from,
                     double to) {
  const Eigen::Matrix<double, 6, 1> none = Eigen::Matrix<double, 6, 1>::Zero();
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from) / kStep - 1e-9)));
  const double dt = (to - from) / steps;
  for (int k = 0; k < steps; ++k) {
    RotorMidpointStep(model, data.InputAt(from + (k + 0.5) * dt), none.data(), dt, x.data());
    x.head<4>().normalize();
  }
  return x;
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
      RunRotorEkf(model, DrivenBy(calibrated, data), Following(calibrated, noise));
  const RotorData driven = DrivenBy(constants, data);
  std::vector<OpenLoopError> errors;
  double next = data.poses.front().t + kFirstStart;
  for (const RotorEstimate& start : run.history) {
    if (start.t < next) continue;
    next = start.t + spacing;
    for (const double horizon : horizons) {
      const RotorPose* pose = PoseNear(data, start.t + horizon);
      if (pose == nullptr) continue;
      const RotorState end =
          Integrate(model, driven, Joined(start.moving, constants), start.t, pose->t);
      Eigen::Vector3d p_E;
      RotorAeroModel::Position(end.data(), p_E.data());
      errors.push_back({start.t, horizon, (p_E - pose->p_E).norm()});
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
  return RunRotorEkf(model, DrivenBy(calibrated, data), options).forecasts;
}

}  // namespace trueline
