#include "problems/rotor/smooth_speeds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/common/random.h"

namespace trueline {
namespace {

struct Series {
  std::vector<double> t;
  Eigen::MatrixXd speeds;
};

// Thrust changes all speeds by up to 150 rad/s, a moment their difference by up to 15 rad/s.
Series Measured(double noise, int count = 2000) {
  Random random(4, "speeds");
  Series series{{}, Eigen::MatrixXd(count, 2)};
  for (int i = 0; i < count; ++i) {
    const double t = 0.004 * i;
    const double thrust = 900.0 + 150.0 * std::sin(3.0 * t), moment = 15.0 * std::sin(11.0 * t);
    series.t.push_back(t);
    series.speeds.row(i) << thrust + moment + noise * random.Normal(),
        thrust - moment + noise * random.Normal();
  }
  return series;
}

double RootMeanSquare(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return std::sqrt((a - b).squaredNorm() / static_cast<double>(a.size()));
}

TEST(SmoothSpeeds, LearnsTheNoiseAndRemovesMostOfIt) {
  const Series truth = Measured(0.0), measured = Measured(10.0);
  const SpeedModel model = LearnSpeedModel(measured.t, measured.speeds);
  const Eigen::MatrixXd smoothed = SmoothSpeeds(measured.t, measured.speeds, model);
  EXPECT_NEAR(model.sigma, 10.0, 0.7);
  EXPECT_LT(RootMeanSquare(smoothed, truth.speeds), 3.0);
  EXPECT_GT(RootMeanSquare(measured.speeds, truth.speeds), 9.0);
}

TEST(SmoothSpeeds, AgainKeepsMoreOfWhatChanges) {
  const Series truth = Measured(0.0), measured = Measured(10.0);
  const SpeedModel model = LearnSpeedModel(measured.t, measured.speeds);
  const auto lost = [&](int again) {
    return RootMeanSquare(SmoothSpeeds(truth.t, truth.speeds, model, again), truth.speeds);
  };
  EXPECT_LT(lost(1), 0.6 * lost(0));
  EXPECT_LT(lost(3), lost(1));
}

TEST(SmoothSpeeds, LeavesExactSpeedsAsTheyAre) {
  const Series exact = Measured(0.0);
  const SpeedModel model = LearnSpeedModel(exact.t, exact.speeds);
  EXPECT_LT(RootMeanSquare(SmoothSpeeds(exact.t, exact.speeds, model), exact.speeds), 0.05);
  const Eigen::MatrixXd still = Eigen::RowVector2d(800.0, 900.0).replicate(100, 1);
  const std::vector<double> t(exact.t.begin(), exact.t.begin() + 100);
  EXPECT_EQ(LearnSpeedModel(t, still).sigma, 0.0);
  EXPECT_EQ(SmoothSpeeds(t, still, {}), still);
}

TEST(SmoothSpeeds, KeepsFewSamples) {
  const Series few = Measured(10.0, 5);
  const SpeedModel model = LearnSpeedModel(few.t, few.speeds);
  EXPECT_EQ(model.sigma, 0.0);
  EXPECT_EQ(SmoothSpeeds(few.t, few.speeds, model), few.speeds);
}

}  // namespace
}  // namespace trueline
