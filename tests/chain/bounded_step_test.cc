#include "problems/chain/bounded_step.h"

#include <gtest/gtest.h>

#include <limits>

namespace trueline {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
const Eigen::Matrix3d kM = (Eigen::Matrix3d() << 4, 1, 0, 1, 3, 1, 0, 1, 2).finished();
const Eigen::Vector3d kB(-4.0, 6.0, -2.0);

TEST(BoundedStep, IsTheNewtonStepWithoutBounds) {
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNone);
  EXPECT_LT((BoundedStep(kM, kB, -none, none) + kM.inverse() * kB).norm(), 1e-12);
}

TEST(BoundedStep, HoldsWhatIsBeyondABoundAndSolvesTheOthersBesideIt) {
  const Eigen::Vector3d lowest(-kNone, -1.0, -kNone), highest(kNone, kNone, 0.0);
  const Eigen::Vector3d step = BoundedStep(kM, kB, lowest, highest);
  const Eigen::Vector3d gradient = kM * step + kB;
  EXPECT_DOUBLE_EQ(step[1], -1.0);  // the whole step goes to -3.6
  EXPECT_GT(gradient[1], 0.0);
  EXPECT_DOUBLE_EQ(step[2], 0.0);
  EXPECT_LT(gradient[2], 0.0);
  EXPECT_NEAR(gradient[0], 0.0, 1e-12);
}

TEST(BoundedStep, WhatMayNotMoveStays) {
  const Eigen::Vector3d most(kNone, 0.0, kNone);
  const Eigen::Vector3d step = BoundedStep(kM, kB, -most, most);
  EXPECT_EQ(step[1], 0.0);
  EXPECT_NEAR(step[0], 1.0, 1e-12);
  EXPECT_NEAR(step[2], 1.0, 1e-12);
}

}  // namespace
}  // namespace trueline
