// Runs whose truth is known: what the model itself predicts.
#pragma once

#include <random>

#include "problems/prediction/fit_prediction.h"

namespace trueline::testing_prediction {

// A quadrotor of 45 g with numbers as config/experiments/nanodrone.yaml starts from.
inline RotorAirVehicle SmallVehicle() {
  RotorAirVehicle vehicle;
  vehicle.mass = 0.045;
  vehicle.radius = 0.0275;
  vehicle.rotors = {{{0.0353, -0.0353, 0.0}, -1},
                    {{-0.0353, -0.0353, 0.0}, 1},
                    {{-0.0353, 0.0353, 0.0}, -1},
                    {{0.0353, 0.0353, 0.0}, 1}};
  return vehicle;
}

inline std::vector<double> SmallNumbers() {
  std::vector<double> c(WindowPrediction::kCount, 0.0);
  c[RotorAir::kThrust] = 0.01725;
  c[RotorAir::kThrustInflow] = 0.033;
  c[RotorAir::kDrag] = 0.0346;
  c[RotorAir::kMoment] = 0.042;
  c[RotorAir::kTorque] = 0.00243;
  c[RotorAir::kRotorInertia] = 2.7e-8;
  c[RotorAir::kInertia] = 2.7e-5;
  c[RotorAir::kInertia + 1] = 3.0e-5;
  c[RotorAir::kInertia + 2] = 3.2e-5;
  c[RotorAir::kWakeLag] = 0.05;
  c[WindowPrediction::kVelocity] = 0.1;
  c[WindowPrediction::kVelocity + 1] = 0.7;
  c[WindowPrediction::kRateShare] = 1.0;
  c[WindowPrediction::kBraking] = 0.14;
  return c;
}

// A run of one window from a random state under random speeds about hover; its later rows are what
// the model with `numbers` predicts.
inline PredictionRun RunOfModel(const std::string& trajectory, const std::vector<double>& numbers,
                                int seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  PredictionRun run;
  run.name = run.trajectory = trajectory;
  run.states.setZero(13, PredictionWindow::kSteps + 1);
  run.speeds.resize(4, PredictionWindow::kSteps + 1);
  for (int i = 0; i < 4; ++i) {
    const double offset = 15.0 * normal(random);
    for (Eigen::Index k = 0; k < run.speeds.cols(); ++k) {
      run.speeds(i, k) = 1722.0 + offset + 15.0 * normal(random);
    }
  }
  auto first = run.states.col(0);
  for (int i = 3; i < 6; ++i) first[i] = normal(random);
  first.segment<4>(6) =
      Eigen::Vector4d(1.0, 0.1 * normal(random), 0.1 * normal(random), 0.1 * normal(random))
          .normalized();
  for (int i = 10; i < 13; ++i) first[i] = 0.3 * normal(random);
  PredictedStates<double> states;
  PredictionModel(SmallVehicle(), {}, numbers)
      .prediction.Predict(numbers.data(), WindowAt(run, 0), &states);
  for (int k = 0; k < PredictionWindow::kSteps; ++k) {
    run.states.col(k + 1) << states[k].p, states[k].v, states[k].q, states[k].w;
  }
  return run;
}

}  // namespace trueline::testing_prediction
