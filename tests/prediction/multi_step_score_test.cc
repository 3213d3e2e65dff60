// The benchmark's metric and baselines against sums by hand and against the published figures.
#include "problems/prediction/multi_step_score.h"

#include "tests/common/test_files.h"

namespace trueline {
namespace {

// `windows` windows; position x = start + slope row, level, at rest.
PredictionRun StraightRun(int windows, double start, double slope) {
  PredictionRun run;
  run.name = run.trajectory = "straight";
  run.states.setZero(13, windows + PredictionWindow::kSteps);
  for (Eigen::Index row = 0; row < run.states.cols(); ++row) {
    run.states(0, row) = start + slope * static_cast<double>(row);
    run.states(6, row) = 1.0;
  }
  run.speeds.setZero(4, run.states.cols());
  return run;
}

TEST(MultiStepScore, AveragesByHand) {
  const PredictionRun a = StraightRun(2, 0.0, 1.0), b = StraightRun(2, 100.0, 2.0);
  const MultiStepScore score = Score(NaivePredictor(), {&a, &b}, 1);
  EXPECT_DOUBLE_EQ(score.within.mean[0][0], 1.5);
  EXPECT_DOUBLE_EQ(score.within.mean[0][49], 75.0);
  // First steps in a row: 1, 2, 102, 104; predictions 0, 1, 100, 102.
  EXPECT_DOUBLE_EQ(score.concatenated.mean[0][0], (1.0 + 1.0 + 2.0 + 2.0) / 4.0);
  EXPECT_DOUBLE_EQ(score.concatenated.mean[0][1], (2.0 + 101.0 + 4.0) / 3.0);
  EXPECT_DOUBLE_EQ(score.concatenated.mean[0][3], 104.0);
}

TEST(MultiStepScore, WeighsRunsAlikeWithin) {
  const PredictionRun a = StraightRun(30, 0.0, 1.0), b = StraightRun(1, 0.0, 3.0);
  EXPECT_DOUBLE_EQ(Score(NaivePredictor(), {&a, &b}, 2).within.mean[0][0], 2.0);
}

TEST(MultiStepScore, AttitudeErrorDoesNotTakeTheShorterWay) {
  Eigen::Matrix<double, 13, 1> truth = Eigen::Matrix<double, 13, 1>::Zero(), predicted = truth;
  truth[6] = 1.0;
  predicted[6] = std::cos(1.8);  // turned by 3.6 rad
  predicted[7] = std::sin(1.8);
  EXPECT_NEAR(StateErrors(truth, predicted)[2], 3.6, 1e-12);
}

TEST(PublishedPhysics, FallsAndHovers) {
  PredictionRun run = StraightRun(1, 0.0, 0.0);
  const Eigen::Matrix<double, 13, 1> fallen = PublishedPhysics(0.0).predict(run, 0).col(49);
  EXPECT_NEAR(fallen[2], -0.5 * 9.81 * 0.25, 1e-9);
  EXPECT_NEAR(fallen[5], -9.81 * 0.5, 1e-9);
  run.speeds.setConstant(std::sqrt(0.045 * 9.81 / (4.0 * 3.72e-8)));
  EXPECT_NEAR(PublishedPhysics(0.0).predict(run, 0).col(49).head<6>().norm(), 0.0, 1e-9);
}

TEST(PublishedPhysics, DragSlowsByItsRate) {
  PredictionRun run = StraightRun(1, 0.0, 0.0);
  run.speeds.setConstant(std::sqrt(0.045 * 9.81 / (4.0 * 3.72e-8)));
  run.states(3, 0) = 2.0;
  EXPECT_NEAR(PublishedPhysics(0.42).predict(run, 0)(3, 49), 2.0 * std::exp(-0.42 * 0.5), 1e-9);
}

// Errors of the two published baselines on the training runs, as a third party states them.
TEST(PublishedPhysics, SlowScoresOfTheTrainingRuns) {
  const auto folder = DataFolder() / "nanodrone_benchmark/train";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is missing; set TRUELINE_DATA";
  const std::vector<PredictionRun> runs = ReadPredictionRuns(folder);
  std::vector<const PredictionRun*> square;
  for (const PredictionRun& run : runs) {
    if (run.trajectory == "square") square.push_back(&run);
  }
  ASSERT_EQ(square.size(), 4u);
  const MultiStepScore naive = Score(NaivePredictor(), square, 2);
  const MultiStepScore physics = Score(PublishedPhysics(0.0), square, 2);
  const double within[][2] = {
      {9.2109, 4.4850}, {44.345, 34.834}, {20.907, 24.064}, {141.26, 141.26}};
  for (int a = 0; a < 4; ++a) {
    EXPECT_NEAR(naive.within.Sum(a), within[a][0], 2e-4 * within[a][0]) << a;
    EXPECT_NEAR(physics.within.Sum(a), within[a][1], 2e-4 * within[a][1]) << a;
  }
  EXPECT_NEAR(naive.concatenated.Sum(0), 9.2933, 2e-3);
  EXPECT_NEAR(physics.concatenated.Sum(0), 4.6102, 2e-3);
}

}  // namespace
}  // namespace trueline
