#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "problems/common/random.h"
#include "problems/diagnosis/misfit.h"

namespace trueline {
namespace {

TEST(VarianceShares, BinsHoldEqualNumbersAndNoneForNoValue) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(QuantileBins({5.0, 1.0, none, 3.0, 9.0}, 2), (std::vector<int>{1, 0, -1, 0, 1}));
  EXPECT_EQ(QuantileBins({2.0, 2.0, 2.0}, 3), (std::vector<int>{0, 0, 0}));
}

// Two groups at +-1 with noise of 0.5 have a share of 1 / (1 + 0.25).
TEST(VarianceShares, IsThatBetweenTheGroups) {
  Random random(2, "groups");
  std::vector<Eigen::Vector2d> errors, noise;
  std::vector<int> bin;
  for (int i = 0; i < 400; ++i) {
    bin.push_back(i % 2);
    noise.emplace_back(0.5 * random.Normal(), 0.0);
    errors.push_back(noise.back() + Eigen::Vector2d(i % 2 == 0 ? 1.0 : -1.0, 0.0));
  }
  const VarianceShare shown = VarianceShareOf(errors, bin), chance = VarianceShareOf(noise, bin);
  EXPECT_NEAR(shown.share, 0.8, 0.03);
  EXPECT_LT(shown.p, 1e-10);
  EXPECT_LT(chance.share, 0.02);
  EXPECT_GT(chance.p, 0.001);
  EXPECT_EQ(VarianceShareOf(noise, std::vector<int>(400, 3)).share, 0.0);  // a single group
                                                                           // explains nothing
}

}  // namespace
}  // namespace trueline
