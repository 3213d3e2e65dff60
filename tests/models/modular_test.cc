#include "cost_functions/numbers/modular.h"

#include <gtest/gtest.h>

namespace trueline {
namespace {

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
