#include "problems/diagnosis/gain.h"

#include <gtest/gtest.h>

#include "problems/common/random.h"
#include "problems/diagnosis/confirm.h"

namespace trueline {
namespace {

// Errors of 20 arcs around a mean, m.
std::map<int, double> Arcs(double mean, double spread) {
  Random random(3, "arcs");
  std::map<int, double> arcs;
  for (int i = 0; i < 20; ++i) arcs[i] = mean + spread * random.Normal();
  return arcs;
}

TEST(Gain, TakesTheArcsThatBothPredict) {
  std::map<int, double> before = Arcs(0.5, 0.02), after = Arcs(0.2, 0.0);
  before.erase(4);
  after.erase(7);
  const Gain gain = GainBetween(before, after);
  EXPECT_EQ(gain.arcs, 18);
  EXPECT_NEAR(gain.before - gain.after, 0.3, 0.02);
  EXPECT_GT(gain.low, 0.27);
  EXPECT_LT(gain.high, 0.33);
  EXPECT_LT(gain.low, gain.high);
  EXPECT_EQ(GainBetween(before, {}).arcs, 0);
}

// Three neighbours with equal errors count as one: the interval is wider than for 60 independent
// arcs.
TEST(Gain, RunsOfAlikeArcsWidenTheInterval) {
  std::map<int, double> nothing, alike;
  Random random(5, "runs");
  double squares = 0.0;
  for (int i = 0; i < 60; ++i) {
    nothing[i] = 0.0;
    alike[i] = i % 3 == 0 ? random.Normal() : alike[i - 1];
    squares += alike[i] * alike[i];
  }
  const Gain gain = GainBetween(alike, nothing);
  const double as_independent = 2 * 1.96 * std::sqrt(squares) / 60.0;
  EXPECT_GT(gain.high - gain.low, 1.3 * as_independent);
  EXPECT_LT(gain.high - gain.low, 2.0 * as_independent);
}

Cause AnyCause() { return {{}, {}, {}, 0.0, {}, {}, {}, {}, {}}; }

TEST(Confirm, MoreThanHalfOfTheOtherFlightsMustRepeatIt) {
  const auto confirmed = [](const std::vector<std::string>& outcomes) {
    std::vector<Cause> causes{AnyCause()};
    for (const std::string& outcome : outcomes) {
      causes[0].repeats.push_back({"", outcome, {}, {}, 1.0});
    }
    JudgeRepeats(&causes);
    return causes[0].confirmed;
  };
  EXPECT_FALSE(confirmed({}).has_value());  // a single flight confirms nothing
  EXPECT_TRUE(confirmed({"repeats"}).value());
  EXPECT_FALSE(confirmed({"differs"}).value());
  EXPECT_FALSE(confirmed({"can't be tested"}).value());
  EXPECT_FALSE(confirmed({"repeats", "not shown"}).value());
  EXPECT_TRUE(confirmed({"repeats", "not shown", "repeats"}).value());
}

}  // namespace
}  // namespace trueline
