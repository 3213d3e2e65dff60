#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "cost_functions/numbers/modular.h"
#include "cost_functions/numbers/taylor.h"

namespace trueline {
namespace {

using Series = Taylor<double, 6>;

Series Polynomial(std::initializer_list<double> coefficients) {
  Series s = Series::Start(*coefficients.begin());
  for (auto c = coefficients.begin() + 1; c != coefficients.end(); ++c) s.Append(*c);
  return s;
}

TEST(Taylor, SinCosAndSqrtHaveTheirTextbookSeries) {
  const Series t = Series::Time(0.0);
  const Series s = sin(t), c = cos(t), r = sqrt(Series(1.0) + t);
  const double factorial[] = {1, 1, 2, 6, 24, 120, 720};
  const double root[] = {1.0, 0.5, -1.0 / 8, 1.0 / 16, -5.0 / 128, 7.0 / 256, -21.0 / 1024};
  for (int i = 0; i <= 6; ++i) {
    EXPECT_NEAR(s[i], i % 2 == 0 ? 0.0 : (i % 4 == 1 ? 1 : -1) / factorial[i], 1e-16);
    EXPECT_NEAR(c[i], i % 2 == 1 ? 0.0 : (i % 4 == 0 ? 1 : -1) / factorial[i], 1e-16);
    EXPECT_NEAR(r[i], root[i], 1e-16);
  }
}

TEST(Taylor, QuotientTimesDivisorIsTheDividend) {
  const Series a = Polynomial({2, -1, 0.5, 3, 1, -2, 7}), b = Polynomial({0.5, 4, -3, 1, 1, 2, -1});
  const Series back = a / b * b;
  for (int i = 0; i <= 6; ++i) EXPECT_NEAR(back[i], a[i], 1e-9);
  const Series geometric = Series(1.0) / (Series(1.0) - Series::Time(0.0));
  for (int i = 0; i <= 6; ++i) EXPECT_DOUBLE_EQ(geometric[i], 1.0);
}

TEST(Taylor, OrderIsThatOfTheLeastKnownFactor) {
  const Series known_to_2 = Polynomial({1, 2, 3});
  EXPECT_EQ((known_to_2 * Series::Time(1.0)).order(), 2);
  EXPECT_EQ((Series(3.0) * Series(2.0)).order(), 6);
  EXPECT_EQ((Series(3.0) * Series(2.0)).degree(), 0);
  EXPECT_EQ(known_to_2.Derivative().order(), 1);
  EXPECT_DOUBLE_EQ(known_to_2.Derivative()[1], 6.0);
}

TEST(Taylor, MixedDegreesAddAndSubtract) {
  const Series a = Polynomial({1, 2, 3, 4, 5, 6, 7}), one(1.0);
  EXPECT_DOUBLE_EQ((one - a)[3], -4.0);
  EXPECT_DOUBLE_EQ((a - one)[0], 0.0);
  EXPECT_DOUBLE_EQ((a + one)[6], 7.0);
  EXPECT_DOUBLE_EQ((-a)[2], -3.0);
}

// x' = -x^2 has the solution x0 / (1 + x0 t): coefficients x0 (-x0)^i, and d/dx0 of them.
TEST(Taylor, JetCoefficientsCarryTheGradientOfTheSolution) {
  using Jet = ceres::Jet<double, 1>;
  using JetSeries = Taylor<Jet, 6>;
  JetSeries x = JetSeries::Start(Jet(0.7, 0));
  for (int k = 0; k < 6; ++k) x.Append((-(x * x))[k] / Jet(k + 1.0));
  for (int i = 0; i <= 6; ++i) {
    EXPECT_NEAR(x[i].a, 0.7 * std::pow(-0.7, i), 1e-15);
    EXPECT_NEAR(x[i].v[0], (i + 1) * std::pow(-0.7, i), 1e-14);
  }
}

TEST(Taylor, ModularCoefficientsAreExact) {
  using Jet = ceres::Jet<Modular, 1>;
  using JetSeries = Taylor<Jet, 6>;
  JetSeries x = JetSeries::Start(Jet(Modular(0.7), 0));
  for (int k = 0; k < 6; ++k) x.Append((-(x * x))[k] / MakeScalar<Jet>(k + 1));
  EXPECT_EQ(x[6].a, Modular(0.7).Power(7));
  EXPECT_EQ(x[6].v[0], Modular(7.0) * Modular(0.7).Power(6));
}

// The schoolbook remainder, by repeated doubling: shares nothing with Modular's folding.
std::uint64_t SlowProduct(std::uint64_t a, std::uint64_t b) {
  std::uint64_t sum = 0;
  for (; b > 0; b >>= 1) {
    if (b & 1) sum = (sum + a) % Modular::kPrime;
    a = (a + a) % Modular::kPrime;
  }
  return sum;
}

TEST(Modular, ProductAgreesWithSchoolbook) {
  const std::uint64_t values[] = {0, 1, 2, Modular::kPrime - 1, 0x123456789abcdefULL, 1ULL << 60};
  for (const std::uint64_t a : values) {
    for (const std::uint64_t b : values) {
      EXPECT_EQ((Modular::FromResidue(a) * Modular::FromResidue(b)).value(), SlowProduct(a, b));
    }
  }
}

TEST(Modular, EveryNonzeroNumberHasItsInverse) {
  for (std::uint64_t a : {std::uint64_t{1}, std::uint64_t{2}, Modular::kPrime - 1,
                          std::uint64_t{987654321987654321}}) {
    const Modular m = Modular::FromResidue(a);
    EXPECT_EQ(m * (Modular(1.0) / m), Modular(1.0));
  }
}

TEST(Modular, DecimalsAreTheFractionsThatAPersonWrote) {
  EXPECT_EQ(Modular(0.1) + Modular(0.2), Modular(0.3));  // false in double
  EXPECT_EQ(Modular(0.071) * Modular(1000.0), Modular(71.0));
  EXPECT_EQ(Modular(-3.81e-7) * Modular(1e9), Modular(-381.0));
  EXPECT_EQ(Modular(-2.0) + Modular(2.0), Modular());
  EXPECT_EQ(Modular(1.5e20) / Modular(1e20), Modular(1.5));
}

TEST(Modular, SineAndCosineLieOnTheCircle) {
  const Modular angle(0.7);
  EXPECT_EQ(sin(angle) * sin(angle) + cos(angle) * cos(angle), Modular(1.0));
  EXPECT_EQ(sin(-angle), -sin(angle));
  EXPECT_EQ(cos(Modular()), Modular(1.0));
  EXPECT_EQ(sin(Modular()), Modular());
}

}  // namespace
}  // namespace trueline
