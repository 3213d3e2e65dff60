// Fits to made runs give back the numbers that made them.
#include "problems/prediction/fit_prediction.h"

#include <gtest/gtest.h>

#include "problems/prediction/multi_step_score.h"
#include "tests/prediction/made_run.h"

namespace trueline::testing_prediction {
namespace {

PredictionSetup HeldSetup() {
  PredictionSetup setup = SmallSetup();
  setup.learn_processes = false;
  setup.processes = {};  // as RunOfModel
  setup.iterations = 30;
  for (FittedNumber& number : setup.numbers) number.free = false;
  return setup;
}

TEST(FitPrediction, RecoversNumbers) {
  const std::vector<double> truth = SmallNumbers();
  std::vector<PredictionRun> runs;
  for (int i = 0; i < 24; ++i) runs.push_back(RunOfModel(i % 2 ? "one" : "other", truth, i));
  std::vector<const PredictionRun*> pointers;
  for (const PredictionRun& run : runs) pointers.push_back(&run);
  PredictionSetup setup = HeldSetup();
  for (const char* name : {"k_f", "rotor_speed_drag.k", "M_u", "I_x", "b_w"}) {
    FittedNumber& number = setup.numbers[IndexOf(name, setup.numbers)];
    number.free = true;
    number.start *= 1.1;
  }
  const PredictionFit fit = FitPrediction(setup, pointers, 0);  // all cores: the command's default
  EXPECT_EQ(fit.windows, 24);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(fit.numbers[i], truth[i], 0.01 * std::abs(truth[i])) << setup.numbers[i].name;
    EXPECT_EQ(fit.sigmas[i] > 0.0, setup.numbers[i].free) << setup.numbers[i].name;
  }
}

// The processes' numbers must not take the braking for theirs.
TEST(FitProcesses, KeepsNumbersThatAreRight) {
  const std::vector<double> truth = SmallNumbers();
  std::vector<PredictionRun> runs;
  for (int i = 0; i < 12; ++i) runs.push_back(RunOfModel("one", truth, i));
  std::vector<const PredictionRun*> pointers;
  for (const PredictionRun& run : runs) pointers.push_back(&run);
  PredictionSetup setup = HeldSetup();
  FitProcesses(setup, truth, ChooseWindows(pointers, 12), 1, &setup.processes);
  for (const StabilisedProcessNumbers& n : setup.processes) {
    EXPECT_NEAR(n.length, StabilisedProcessNumbers{}.length, 1e-3);
    EXPECT_NEAR(n.constant, StabilisedProcessNumbers{}.constant, 0.1);
  }
}

TEST(VehiclePredictor, GivesTheModelsOwnRunBack) {
  const std::vector<double> truth = SmallNumbers();
  const PredictionRun run = RunOfModel("one", truth, 5);
  const PredictionModel model(SmallVehicle(), {}, truth);
  const MultiStepScore score = Score(VehiclePredictor("model", model.prediction, truth), {&run}, 1);
  for (int a = 0; a < 4; ++a) EXPECT_NEAR(score.within.Sum(a), 0.0, 1e-9);
}

}  // namespace
}  // namespace trueline::testing_prediction
