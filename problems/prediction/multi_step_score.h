// The metric of the NanoDrone benchmark: mean absolute errors of position, velocity, attitude and
// rate at every horizon, as its repository and as its text compute them.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "problems/prediction/prediction_run.h"

namespace trueline {

using WindowStates =
    Eigen::Matrix<double, 13, PredictionWindow::kSteps>;  // as PredictionRun::states

WindowStates StatesOf(const PredictedStates<double>& predicted);

struct Predictor {
  std::string name;
  // The states of the rows that follow `row`, from the state there and the speeds from there on.
  std::function<WindowStates(const PredictionRun& run, int row)> predict;
};

inline constexpr const char* kScoredQuantities[] = {"p", "v", "R", "w"};
inline constexpr const char* kScoredUnits[] = {"m", "m/s", "rad", "rad/s"};

struct MultiStepErrors {
  // By quantity and horizon, m, m/s, rad, rad/s.
  std::array<std::array<double, PredictionWindow::kSteps>, 4> mean = {};

  double Sum(int quantity) const;  // over all horizons
};

struct MultiStepScore {
  // Window i at horizon h is compared with the first-step truth of window i + h - 1 of all runs in
  // a row, as the repository's metric does: the last windows of a run meet the first rows of the
  // next, and what has no partner is left out.
  MultiStepErrors concatenated;
  MultiStepErrors within;  // every window with its own run; mean of the runs' means
};

// |p - p'|, |v - v'|, 2 atan2(|u|, s) of conj(q) q' = (s, u) without taking the shorter way, |w -
// w'|.
std::array<double, 4> StateErrors(const Eigen::Matrix<double, 13, 1>& truth,
                                  const Eigen::Matrix<double, 13, 1>& predicted);

MultiStepScore Score(const Predictor& predictor, const std::vector<const PredictionRun*>& runs,
                     int threads);

// The state held.
Predictor NaivePredictor();
// The benchmark's own physics (thrust, gravity, rates held), Runge-Kutta at 10 ms; `drag` in 1/s
// slows the velocity, 0 as published.
Predictor PublishedPhysics(double drag);
Predictor VehiclePredictor(const std::string& name, const WindowPrediction& prediction,
                           const std::vector<double>& numbers);

}  // namespace trueline
