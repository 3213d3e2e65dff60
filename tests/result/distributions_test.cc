#include <gtest/gtest.h>

#include "problems/common/random.h"
#include "problems/result/statistics.h"

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

TEST(Distributions, UncertainSigmaIsStudentsWithoutAPriorAndNormalWithASharpOne) {
  constexpr double kRatio = 100.0, kDof = 6.0, kTimes = 55.0;
  const double student = FTail(kTimes * kTimes / kRatio, 1, kDof);
  EXPECT_NEAR(UncertainSigma(kRatio, kDof, 1e3).Tail(kTimes) / student, 1.0, 0.01);
  EXPECT_NEAR(UncertainSigma(1.0, 2.0, 1e-3).Tail(3.0), ChiSquareTail(9.0, 1), 1e-5);
  EXPECT_LT(UncertainSigma(1.0, 2.0, std::log(3.0)).Tail(100.0), 1e-6);
  EXPECT_GT(FTail(100.0 * 100.0, 1, 2.0), 5e-5);  // what few degrees of freedom say alone
}

TEST(Distributions, UncertainSigmaIsTheMeasuredOneWithManyDegreesOfFreedom) {
  EXPECT_NEAR(UncertainSigma(9.0, 1000.0, 1.0).Factor(), 3.0, 0.02);
  EXPECT_NEAR(UncertainSigma(0.5, 1000.0, 1.0).Factor(), 1.0, 0.02);
  EXPECT_NEAR(UncertainSigma(1.0, 1e5, 0.7).Factor(), 1.0, 0.02);
  EXPECT_GT(UncertainSigma(0.5, 2.0, 0.7).Factor(), 1.2);
}

// Chances are frequencies where the sigma is drawn from the prior.
TEST(Distributions, UncertainSigmaHasTheRightChance) {
  constexpr double kSpread = 1.1;
  constexpr int kDraws = 5000;
  for (const int dof : {1, 3, 8}) {
    Random random(1, "scatter");
    int below = 0;
    for (int i = 0; i < kDraws; ++i) {
      const double r = std::exp(kSpread * std::abs(random.Normal()));
      double squares = 0.0;
      for (int k = 0; k < dof; ++k) squares += std::pow(r * random.Normal(), 2);
      const double times = std::abs(r * random.Normal());
      below += UncertainSigma(squares / dof, dof, kSpread).Tail(times) < 0.02;
    }
    EXPECT_NEAR(below, 0.02 * kDraws, 30) << dof;  // three sigma
  }
}

}  // namespace
}  // namespace trueline
