#include "problems/result/distributions.h"

#include <gtest/gtest.h>

#include "problems/common/random.h"

namespace trueline {
namespace {

// Values of printed tables (Abramowitz and Stegun, tables 26.8 and 26.9).
TEST(Distributions, MatchPrintedTables) {
  EXPECT_NEAR(ChiSquareTail(3.841459, 1), 0.05, 1e-6);
  EXPECT_NEAR(ChiSquareTail(11.344867, 3), 0.01, 1e-6);
  EXPECT_NEAR(ChiSquareCritical(0.001, 2), 13.815511, 1e-4);
  EXPECT_NEAR(FTail(4.351244, 1, 20), 0.05, 1e-6);
  EXPECT_NEAR(FTail(4.938193, 3, 20), 0.01, 1e-6);
  EXPECT_NEAR(FCritical(0.05, 2, 10), 4.102821, 1e-4);
  EXPECT_NEAR(ChiSquareTail(60.0, 1), 9.5e-15, 1e-15);  // far tails keep their size
}

// With one degree of freedom the non-centrality is (z_alpha + z_power)^2, but for a negligible
// tail.
TEST(Distributions, NonCentralityGivesThePower) {
  EXPECT_NEAR(NonCentralityFor(ChiSquareCritical(0.05, 1), 1, 0.95), 12.9947, 1e-3);
  Random random(1, "power");
  const double lambda = NonCentralityFor(ChiSquareCritical(0.01, 3), 3, 0.95);
  int found = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::Vector3d x = random.NormalVector3();
    x.x() += std::sqrt(lambda);
    found += x.squaredNorm() > 11.344867;
  }
  EXPECT_NEAR(found / double(kDraws), 0.95, 0.015);
}

}  // namespace
}  // namespace trueline
