// Fits to made runs give back the numbers that made them.
#include "problems/prediction/fit_prediction.h"

#include <gtest/gtest.h>

#include "problems/prediction/fit_processes.h"
#include "problems/prediction/multi_step_score.h"
#include "tests/prediction/made_run.h"

namespace trueline::testing_prediction {
namespace {

PredictionSetup SetupOf(const std::vector<double>& start) {
  PredictionSetup setup;
  setup.vehicle = SmallVehicle();
  setup.learn_processes = false;
  setup.iterations = 30;
  for (const double number : start) {
    setup.numbers.push_back({number, number != 0.0 ? std::abs(number) : 1.0, false});
  }
  return setup;
}

TEST(FitPrediction, RecoversNumbers) {
  const std::vector<double> truth = SmallNumbers();
  std::vector<PredictionRun> runs;
  for (int i = 0; i < 24; ++i) runs.push_back(RunOfModel(i % 2 ? "one" : "other", truth, i));
  std::vector<const PredictionRun*> pointers;
  for (const PredictionRun& run : runs) pointers.push_back(&run);
  PredictionSetup setup = SetupOf(truth);
  for (const int i : {int(RotorAir::kThrust), int(RotorAir::kDrag), int(RotorAir::kMoment),
                      int(RotorAir::kInertia), int(WindowPrediction::kBraking)}) {
    setup.numbers[i].free = true;
    setup.numbers[i].start *= 1.1;
  }
  const PredictionFit fit = FitPrediction(setup, pointers, 0);  // all cores: the command's default
  EXPECT_EQ(fit.windows, 24);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(fit.numbers[i], truth[i], 0.01 * std::abs(truth[i]))
        << PredictionNumberInfo(i).name;
    EXPECT_EQ(fit.sigmas[i] > 0.0, setup.numbers[i].free) << PredictionNumberInfo(i).name;
  }
}

// The processes' numbers must not take the braking for theirs.
TEST(FitProcesses, KeepsNumbersThatAreRight) {
  const std::vector<double> truth = SmallNumbers();
  std::vector<PredictionRun> runs;
  for (int i = 0; i < 12; ++i) runs.push_back(RunOfModel("one", truth, i));
  std::vector<const PredictionRun*> pointers;
  for (const PredictionRun& run : runs) pointers.push_back(&run);
  PredictionSetup setup = SetupOf(truth);
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
