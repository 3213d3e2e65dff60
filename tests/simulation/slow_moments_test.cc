// Eddies have the size asked for, and change slowly.
#include <gtest/gtest.h>

#include "problems/simulation/forces.h"

namespace trueline::simulation {
namespace {

TEST(SlowMoments, HaveTheirSizeAndChangeSlowly) {
  constexpr double kStep = 0.01;  // s
  constexpr int kSamples = 400000;
  SlowMoments moments(6.0, 3);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero(), changes = squares, before = moments.At(0.0);
  for (int k = 1; k <= kSamples; ++k) {
    const Eigen::Vector3d now = moments.At(k * kStep);
    squares += now.cwiseAbs2();
    changes += (now - before).cwiseAbs2();
    before = now;
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(squares[axis] / kSamples), 6.0, 0.3);
    EXPECT_LT(std::sqrt(changes[axis] / kSamples), 0.6);
  }
}

TEST(SlowMoments, AreAbsentUnlessAskedFor) {
  SlowMoments none(0.0, 3);
  for (double t = 0.0; t < 10.0; t += 0.1) EXPECT_EQ(none.At(t), Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace trueline::simulation
