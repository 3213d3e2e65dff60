#include "problems/diagnosis/gain.h"

#include <gtest/gtest.h>

#include "problems/common/random.h"
#include "problems/diagnosis/confirm.h"
#include "problems/diagnosis/rules.h"

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

// The interval holds the true mean, 0, as often as it says, however few arcs there are; the
// bootstrap alone did so 83 % of the time with 10 of them.
TEST(Gain, IntervalsOfFewArcsHoldTheTruth) {
  constexpr int kFlights = 400;
  Random random(7, "few arcs");
  for (const int count : {6, 10, 15, 30}) {
    int inside = 0;
    for (int flight = 0; flight < kFlights; ++flight) {
      std::map<int, double> before, after;
      for (int i = 0; i < count; ++i) {
        before[i] = 1.0 + 0.1 * random.Normal();
        after[i] = 1.0 + 0.1 * random.Normal();
      }
      const Gain gain = GainBetween(before, after);
      inside += gain.low <= 0.0 && 0.0 <= gain.high;
    }
    EXPECT_GE(inside, 0.92 * kFlights) << count;
    if (count > 10) EXPECT_LE(inside, 0.99 * kFlights) << count;
  }
}

TEST(Gain, TooFewArcsGiveNoInterval) {
  const Gain gain = GainBetween({{0, 0.5}, {1, 0.4}, {2, 0.5}}, {{0, 0.3}, {1, 0.5}, {2, 0.5}});
  EXPECT_EQ(gain.arcs, 3);
  EXPECT_FALSE(gain.low > 0.0 || gain.high < 0.0);
}

Cause CauseOf(const std::string& id) {
  return {{FindDeclared(id), {}}, {}, {}, 0.0, {}, {}, {}, {}, {}};
}

TEST(Confirm, MoreThanHalfOfTheOtherFlightsMustRepeatIt) {
  const auto confirmed = [](const std::vector<std::string>& outcomes,
                            const std::string& id = "fix_scale") {
    std::vector<Cause> causes{CauseOf(id)};
    for (const std::string& outcome : outcomes) {
      causes[0].repeats.push_back({"", outcome, {}, {}, 1.0});
    }
    JudgeRepeats(&causes);
    return causes[0].confirmed;
  };
  EXPECT_FALSE(confirmed({}).has_value());  // a single flight confirms nothing
  EXPECT_TRUE(confirmed({"repeats"}).value());
  EXPECT_FALSE(confirmed({"differs"}).value());
  EXPECT_FALSE(confirmed({"can't be tested"}).has_value());
  EXPECT_TRUE(confirmed({"can't be tested", "repeats"}).value());
  EXPECT_FALSE(confirmed({"can't be tested", "not shown"}).value());
  // The wind of another day tells nothing of this one, unless it is the same.
  EXPECT_FALSE(confirmed({"differs", "not shown"}, "wind").has_value());
  EXPECT_TRUE(confirmed({"repeats"}, "wind").value());
  EXPECT_FALSE(confirmed({"repeats", "not shown"}).value());
  EXPECT_TRUE(confirmed({"repeats", "not shown", "repeats"}).value());
}

TEST(ChooseModel, IntervalsContainWhatTheModelLacks) {
  std::vector<ParameterEstimate> without{{"K_x", -0.25, 0.03, "1/s", ""},
                                         {"K_y", -0.4, 0.02, "1/s", ""}};
  WidenByChange({{"K_x", -0.29, 0.02, "1/s", ""}}, &without);
  EXPECT_NEAR(without[0].sigma, 0.05, 1e-12);
  EXPECT_EQ(without[0].value, -0.25);
  EXPECT_EQ(without[1].sigma, 0.02);
}

}  // namespace
}  // namespace trueline
