// Runs whose truth is known: what the model itself predicts.
#pragma once

#include <algorithm>
#include <random>

#include "problems/prediction/multi_step_experiment.h"

namespace trueline::testing_prediction {

// The quadrotor of 45 g and its numbers, as the shipped experiment starts from them.
inline PredictionSetup SmallSetup() {
  return ReadMultiStepExperiment(std::filesystem::path(TRUELINE_TEST_SOURCE_DIR) /
                                 "config/experiments/nanodrone.yaml")
      .setup;
}
inline PredictedVehicle SmallVehicle() { return SmallSetup().vehicle; }

inline std::vector<double> SmallNumbers() {
  std::vector<double> c;
  for (const FittedNumber& number : SmallSetup().numbers) c.push_back(number.start);
  return c;
}

// Of a number, by name.
inline std::size_t IndexOf(const std::string& name, const std::vector<FittedNumber>& numbers) {
  return std::ranges::find(numbers, name, &FittedNumber::name) - numbers.begin();
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
