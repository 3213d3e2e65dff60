// Factors that follow a run which errs by another scale, or with other tails, than the training.
#include "problems/prediction/tube.h"

#include <gtest/gtest.h>

#include <random>

namespace trueline {
namespace {

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
