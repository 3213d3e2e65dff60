// The benchmark's metric and baselines against sums by hand and against the published figures.
#include "problems/prediction/multi_step_score.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <fstream>
#include <random>

#include "problems/prediction/prediction_run.h"
#include "problems/prediction/tube.h"
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

// --- Reading runs: plain or compressed, and what is refused.

std::string RunText(int rows, double step = 0.01) {
  std::string text =
      "t,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz,m1_rads,m2_rads,m3_rads,m4_rads,ax_body\n";
  for (int i = 0; i < rows; ++i) {
    text += fmt::format("{},1,2,3,0,0,0.6,0.8,4,5,6,7,8,9,101,102,103,{},0\n", i * step, 104 + i);
  }
  return text;
}

void Write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

TEST(ReadRuns, PlainAndCompressedAlike) {
  const TestFolder folder;
  Write(folder / "melon_a.csv", RunText(60));
  WriteCompressed(folder / "melon_b.csv.gz", RunText(60));
  Write(folder / "notes.txt", "no run");
  const auto runs = ReadPredictionRuns(folder.directory());
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[1].name, "melon_b");
  EXPECT_EQ(runs[1].trajectory, "melon");
  EXPECT_EQ(runs[0].states, runs[1].states);
  EXPECT_EQ(runs[0].num_windows(), 10);
  Eigen::Matrix<double, 13, 1> state;
  state << 1, 2, 3, 4, 5, 6, 0.8, 0, 0, 0.6, 7, 8, 9;  // w first in memory, last in the file
  EXPECT_EQ(runs[0].states.col(0), state);
  EXPECT_EQ(runs[0].speeds(3, 2), 106.0);
}

TEST(ReadRuns, RunsOfOneTrajectoryDifferByTheirNumber) {
  for (const auto& [names, trajectory] : {std::pair{std::array{"melon_1", "melon_2"}, "melon"},
                                          {{"Melon run 1", "Melon run 2"}, "Melon"},
                                          {{"melon-1", "melon-2"}, "melon"},
                                          {{"run1", "run2"}, "run"}}) {
    const TestFolder folder;
    for (const char* name : names) Write(folder / fmt::format("{}.csv", name), RunText(60));
    for (const PredictionRun& run : ReadPredictionRuns(folder.directory())) {
      EXPECT_EQ(run.trajectory, trajectory) << run.name;
    }
  }
}

TEST(ReadRuns, RefusesWhatIsNoRun) {
  const TestFolder folder;
  const auto error = [&] { return ErrorOf([&] { ReadPredictionRuns(folder.directory()); }); };
  EXPECT_THAT(error(), HasSubstr("no .csv or .csv.gz"));
  Write(folder / "a.csv", RunText(50));
  EXPECT_THAT(error(), HasSubstr("has 50 rows; one window needs 51"));
  Write(folder / "a.csv", RunText(60, 0.02));
  EXPECT_THAT(error(), HasSubstr("a.csv:3: t [s] must grow by 0.01"));
  Write(folder / "a.csv", "t,x\n0,1\n");
  EXPECT_THAT(error(), HasSubstr("has no column 'y'"));
  std::string broken = RunText(60);
  Write(folder / "a.csv", broken.replace(broken.rfind(",9,"), 3, ",?,"));
  EXPECT_THAT(error(), HasSubstr("a.csv:61: column 'wz' holds no finite number"));
}

TEST(ReadRuns, RefusesCutOffCompression) {
  const TestFolder folder;
  WriteCompressed(folder / "a.csv.gz", RunText(600));
  std::filesystem::resize_file(folder / "a.csv.gz",
                               std::filesystem::file_size(folder / "a.csv.gz") / 2);
  EXPECT_THAT(ErrorOf([&] { ReadPredictionRuns(folder.directory()); }), HasSubstr("cut off"));
}

// --- Factors that follow a run which errs by another scale, or with other tails, than the
// training.

// Hold half, and 95 %, of |N(0, 1)|.
Tube StandardFactors() {
  Tube factors;
  for (auto& steps : factors[0]) steps.fill(0.674);
  for (auto& steps : factors[1]) steps.fill(1.960);
  return factors;
}

QuantitySteps AllSteps(double ratio) {
  QuantitySteps ratios;
  for (auto& steps : ratios) steps.fill(ratio);
  return ratios;
}

// Errors keep their sign for half a second, as those of windows that overlap; a tenth of the times
// they are `kick` times larger.
TEST(FollowedFactors, HoldWhateverTheRunsScaleAndTails) {
  constexpr int kWindows = 15000, kLast = PredictionWindow::kSteps - 1;
  for (const auto& [scale, kick] : {std::pair{0.5, 1.0}, {1.0, 1.0}, {2.0, 1.0}, {1.0, 5.0}}) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    FollowedFactors followed(StandardFactors());
    double error = 0.0, half = 0.0, most = 0.0;
    for (int row = 0; row < kWindows; ++row) {
      error = 0.98 * error + std::sqrt(1.0 - 0.98 * 0.98) * normal(random);
      const double ratio = scale * (row / 50 % 10 == 0 ? kick : 1.0) * std::abs(error);
      const Tube factors = followed.Next(row, AllSteps(ratio));
      half += (ratio <= factors[0][0][kLast]) / double{kWindows};
      most += (ratio <= factors[1][0][kLast]) / double{kWindows};
    }
    EXPECT_NEAR(half, 0.50, 0.03) << scale << ' ' << kick;
    EXPECT_NEAR(most, 0.95, 0.02) << scale << ' ' << kick;
  }
}

// What a window errs at step k is known from k + 1 rows after its start on, and not before.
TEST(FollowedFactors, UseFlownStepsOnly) {
  FollowedFactors held(StandardFactors()), missed(StandardFactors());
  for (int row = 0; row < 200; ++row) {
    const Tube narrow = held.Next(row, AllSteps(0.0));
    const Tube wide = missed.Next(row, AllSteps(row == 100 ? 1e6 : 0.0));
    for (int k = 0; k < PredictionWindow::kSteps; ++k) {
      EXPECT_EQ(narrow[1][2][k]<wide[1][2][k], row> 100 + k) << row << ' ' << k;
    }
  }
}

}  // namespace
}  // namespace trueline