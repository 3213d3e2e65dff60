#include "problems/observability/assessment.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace trueline {
namespace {

// Constant-velocity motion, position measured with density 1 over T: K = (1, t), and the Gramian is
// (T, T^2/2; T^2/2, T^3/3); marginalising position leaves T^3/12 for velocity.
Eigen::Matrix2d ConstantVelocityGramian(double T) {
  return (Eigen::Matrix2d() << T, T * T / 2, T * T / 2, T * T * T / 3).finished();
}

TEST(Assessment, BoundOfConstantVelocityIsTheOneInClosedForm) {
  const double T = 4.0;
  const Assessment a = Assess(ConstantVelocityGramian(T), {0, 1}, std::vector<StateInfo>(2));
  EXPECT_NEAR(a.sigma[0], std::sqrt(4.0 / T), 1e-12);
  EXPECT_NEAR(a.sigma[1], std::sqrt(12.0 / (T * T * T)), 1e-12);
  EXPECT_NEAR(SchurComplement(ConstantVelocityGramian(T), {1}, {0})(0, 0), T * T * T / 12, 1e-12);
}

TEST(Assessment, LostSumOfTwoStatesIsNamedAndTheOthersKeepTheirBound) {
  Eigen::MatrixXd k = Eigen::MatrixXd::Random(40, 3);
  k.col(2) = -500.0 * k.col(0);  // states 0 and 2 act as one
  std::vector<StateInfo> info(3);
  const Assessment a = Assess(k.transpose() * k, {0, 1, 2}, info);
  EXPECT_EQ(a.rank.rank, 2);
  EXPECT_EQ(a.rank.StatusOf(0), "joint: J1");
  EXPECT_TRUE(std::isinf(a.sigma[0]));
  const Eigen::MatrixXd two = k.leftCols(2).transpose() * k.leftCols(2);
  EXPECT_NEAR(a.sigma[1], std::sqrt(two.inverse()(1, 1)), 1e-9);
  EXPECT_NEAR(a.rank.blocks[0].directions(1, 0), 1.0 / 500.0, 1e-8);
}

TEST(Assessment, StateThatNoOutputDependsOnIsUnobservable) {
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(3, 3);
  information.topLeftCorner<2, 2>() = ConstantVelocityGramian(2.0);
  const Assessment a = Assess(information, {0, 1, 2}, std::vector<StateInfo>(3));
  EXPECT_EQ(a.rank.StatusOf(2), "unobservable");
  EXPECT_TRUE(std::isinf(a.sigma[2]));
  EXPECT_TRUE(std::isfinite(a.sigma[0]));
}

TEST(Assessment, ScoresOfADiagonalGramian) {
  const GramianScores s = ScoreGramian(Eigen::Vector3d(4.0, 0.25, 1.0).asDiagonal());
  EXPECT_DOUBLE_EQ(s.sigma_min, 0.25);
  EXPECT_DOUBLE_EQ(s.condition, 16.0);
  EXPECT_NEAR(s.log10_determinant, 0.0, 1e-15);
  EXPECT_NEAR(s.per_state[1], 0.25, 1e-15);
}

TEST(Assessment, ScoreDoesNotDependOnTheScaleOfWhatIsMarginalised) {
  const Eigen::MatrixXd k = Eigen::MatrixXd::Random(20, 4);
  const Eigen::MatrixXd w = k.transpose() * k;
  const GramianScores a = ScoreStates(w, {1, 2}, {0, 1, 2, 3}, {1, 1, 1, 1});
  const GramianScores b = ScoreStates(w, {1, 2}, {0, 1, 2, 3}, {1e3, 1, 1, 1e-3});
  EXPECT_NEAR(a.sigma_min, b.sigma_min, 1e-9 * a.sigma_min);
  const GramianScores known = ScoreStates(w, {1, 2}, {1, 2}, {1, 1, 1, 1});
  EXPECT_GT(known.sigma_min, a.sigma_min);
}

}  // namespace
}  // namespace trueline
