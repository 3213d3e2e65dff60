// What a diagnosis may say of causes with given gains, witnesses and other flights.
#include "problems/diagnosis/rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/linearisation.h"

namespace trueline {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Gain GainOf(double before, double after, double low, double high, int independent = 20) {
  Gain gain{independent, before, after, low, high};
  gain.independent = independent;
  return gain;
}

const Gain kBetter = GainOf(0.3, 0.2, 0.05, 0.15), kWorse = GainOf(0.2, 0.3, -0.15, -0.05),
           kSlightlyWorse = GainOf(0.20, 0.21, -0.05, 0.03),
           kEither = GainOf(0.2, 0.199, -0.1, 0.1), kNone;

Cause CauseWith(const Gain& arcs, const Gain& replays, const std::string& witness = "silent",
                std::optional<bool> confirmed = {}) {
  Cause cause{{}, {}, {}, 1e-13, {}, arcs, replays, {}, confirmed};
  cause.witness.says = witness;
  return cause;
}

std::string Why(const Cause& cause) { return WhyNotNamed(cause, true); }

TEST(Harmful, WhereOneMeasureIsWorseAndTheOtherNoBetter) {
  EXPECT_TRUE(Harmful(CauseWith(kWorse, kNone)));
  EXPECT_TRUE(Harmful(CauseWith(kWorse, kEither)));
  EXPECT_TRUE(Harmful(CauseWith(kEither, kWorse)));
  EXPECT_FALSE(Harmful(CauseWith(kWorse, kBetter)));
  EXPECT_FALSE(Harmful(CauseWith(kEither, kEither)));
  EXPECT_FALSE(Harmful(CauseWith(kNone, kNone)));
}

TEST(ClearLoss, NeedsOneMeasureThatIsWorseAndNoneThatIsBetter) {
  EXPECT_TRUE(ClearLoss(kWorse, kNone));
  EXPECT_TRUE(ClearLoss(kWorse, kEither));
  EXPECT_FALSE(ClearLoss(kWorse, kBetter));
  EXPECT_FALSE(ClearLoss(kSlightlyWorse, kEither));
  EXPECT_FALSE(ClearLoss(kNone, kNone));
}

TEST(Rules, ACauseIsNamedByAGainOfItsOwn) {
  EXPECT_EQ(Why(CauseWith(kBetter, kEither)), "");
  EXPECT_EQ(Why(CauseWith(kEither, kBetter)), "");
  EXPECT_THAT(Why(CauseWith(kEither, kEither)), HasSubstr("its gain may be zero"));
  EXPECT_THAT(Why(CauseWith(kSlightlyWorse, kNone)), HasSubstr("its gain may be zero"));
  EXPECT_THAT(Why(CauseWith(kWorse, kEither)), HasSubstr("predicted worse"));
  EXPECT_EQ(WhyNotNamed(CauseWith(kEither, kEither), false), "");  // gains were not measured
}

TEST(Rules, ASizeBelowWhatTheFlightShowsIsNotNamed) {
  Cause cause = CauseWith(kBetter, kBetter);
  cause.times_detectable = 0.7;
  EXPECT_THAT(Why(cause), HasSubstr("0.70 times the size that this flight shows"));
  cause.times_detectable = 1.1;
  EXPECT_EQ(Why(cause), "");
  cause = CauseWith(kBetter, kBetter, "confirms");
  cause.times_detectable = 0.7;
  EXPECT_EQ(Why(cause), "");
}

TEST(Rules, AWitnessOrAnotherFlightStandsInForTheGain) {
  EXPECT_EQ(Why(CauseWith(kEither, kEither, "confirms")), "");
  EXPECT_EQ(Why(CauseWith(kEither, kEither, "silent", true)), "");
  EXPECT_THAT(Why(CauseWith(kEither, kEither, "silent", false)), HasSubstr("its gain may be zero"));
  // An error that both flights have, and that loses on held-out flight.
  EXPECT_THAT(Why(CauseWith(kSlightlyWorse, kNone, "silent", true)), HasSubstr("its gain may be"));
  EXPECT_THAT(Why(CauseWith(kBetter, kBetter, "refutes", true)), HasSubstr("refuted"));
  EXPECT_THAT(WhyNotNamed(CauseWith(kNone, kNone, "refutes"), false), HasSubstr("refuted"));
}

// A scale of fixes of -0.10 +- 0.01 that no flight had: p 1e-9 and 2.5 times its detectable size.
TEST(Rules, ASmallChanceAndALargeSizeStandInForNothing) {
  Cause cause = CauseWith(kEither, kEither);
  cause.p = 1e-9;
  cause.times_detectable = 2.5;
  EXPECT_THAT(Why(cause), HasSubstr("its gain may be zero"));
}

// A lever arm that mocap shows moves the predictions of held-out flight by less than chance.
TEST(Rules, AWitnessOutweighsALossThatMayBeChance) {
  EXPECT_EQ(Why(CauseWith(kSlightlyWorse, kNone, "confirms")), "");
  EXPECT_EQ(Why(CauseWith(kSlightlyWorse, kNone, "confirms", true)), "");
  EXPECT_THAT(Why(CauseWith(kWorse, kEither, "confirms")), HasSubstr("its witness shows it"));
  EXPECT_THAT(Why(CauseWith(kWorse, kEither, "confirms", true)), HasSubstr("its witness shows it"));
  EXPECT_EQ(WhyNotNamed(CauseWith(kWorse, kNone, "confirms"), false), "");
}

// A lever arm of 45 mm that fit and mocap both show, on a flight whose other errors cancel it in
// positions.
TEST(Rules, AWitnessOutweighsAClearLossWhereItsStreamAgreesBetter) {
  const Gain slight = GainOf(0.092, 0.097, -0.0085, -0.0025);
  Cause cause = CauseWith(kEither, slight, "confirms");
  EXPECT_THAT(Why(cause), HasSubstr("its witness shows it"));
  cause.agreement = kBetter;
  EXPECT_EQ(Why(cause), "");
  cause.agreement = GainOf(0.2, 0.196, 0.001, 0.007);  // by less than positions lose
  EXPECT_THAT(Why(cause), HasSubstr("its witness shows it"));
  cause.agreement = kEither;
  EXPECT_THAT(Why(cause), HasSubstr("its witness shows it"));
  cause.agreement = kBetter;
  cause.confirmed = false;
  EXPECT_THAT(Why(cause), HasSubstr("predicted worse"));
  cause = CauseWith(kEither, slight);  // without a witness
  cause.agreement = kBetter;
  EXPECT_THAT(Why(cause), HasSubstr("its gain may be zero"));
}

// A latency of 13 ms that mocap's attitude shows on one half of a flight and not on the other.
TEST(Rules, AWitnessMustHoldOnHeldOutFlight) {
  Cause cause = CauseWith(kEither, kEither, "confirms");
  cause.agreement = GainOf(0.0214, 0.0270, -0.0087, -0.0026);
  EXPECT_THAT(Why(cause), HasSubstr("agrees worse with mocap"));
  cause.confirmed = true;
  EXPECT_EQ(Why(cause), "");
}

// On a Bebop mocap's attitude shows a small error of the filter. It gains nothing on held-out
// flight and another flight does not have it.
TEST(Rules, AWitnessAloneDoesNotOutweighALossAndAnotherFlight) {
  EXPECT_THAT(Why(CauseWith(kSlightlyWorse, kNone, "confirms", false)),
              HasSubstr("predicted worse"));
  EXPECT_EQ(Why(CauseWith(kEither, kNone, "confirms", false)), "");
}

TEST(Rules, NamesMoreNeedsAllThatWasNamedAndOneThatIsShown) {
  const EffectInfo drift{.id = "drift"}, scale{.id = "scale"};
  const auto cause = [](const EffectInfo& info, const Gain& gain,
                        const std::string& witness = "silent") {
    Cause of = CauseWith(gain, kNone, witness);
    of.candidate.info = &info;
    return of;
  };
  const Cause better = cause(drift, kBetter), either = cause(scale, kEither);
  EXPECT_TRUE(NamesMore({better}, {}));
  EXPECT_TRUE(NamesMore({either, better}, {either}));
  EXPECT_FALSE(NamesMore({better, cause(scale, kEither, "confirms")}, {better}));
  EXPECT_FALSE(NamesMore({better, either}, {better}));
  EXPECT_FALSE(NamesMore({better}, {either}));
  EXPECT_FALSE(NamesMore({better}, {better}));
  EXPECT_FALSE(NamesMore({}, {}));
}

TEST(Rules, FourArcsNameNothing) {
  const Gain four = GainOf(0.3, 0.2, 0.05, 0.15, 4), five = GainOf(0.3, 0.2, 0.05, 0.15, 5);
  EXPECT_THAT(Why(CauseWith(four, kNone)), HasSubstr("only 4 independent arcs"));
  EXPECT_EQ(Why(CauseWith(five, kNone)), "");
  EXPECT_EQ(Why(CauseWith(four, kBetter)), "");
  EXPECT_EQ(Why(CauseWith(four, kNone, "confirms")), "");
}

// A mean of 0.1 whose two-sided 95 % interval holds zero narrowly, and clearly.
TEST(Rules, AGainIsPositiveWith95PercentOnOneSide) {
  EXPECT_TRUE(ClearGain(GainOf(0.3, 0.2, -0.01, 0.21), kNone));
  EXPECT_FALSE(ClearGain(GainOf(0.3, 0.2, -0.03, 0.23), kNone));
}

TEST(Rules, AnIntervalNeedsSixArcs) {
  const std::map<int, double> before{{0, 0.3},  {1, 0.4},  {2, 0.35},
                                     {3, 0.33}, {4, 0.34}, {5, 0.36}},
      after{{0, 0.1}, {1, 0.1}};
  const Gain two = GainBetween(before, after);
  EXPECT_EQ(two.arcs, 2);
  EXPECT_NEAR(two.before - two.after, 0.25, 1e-12);
  EXPECT_FALSE(std::isfinite(two.low));
  EXPECT_FALSE(std::isfinite(two.high));
  std::map<int, double> five = before;
  five.erase(5);
  EXPECT_FALSE(std::isfinite(GainBetween(before, five).low));
  EXPECT_TRUE(std::isfinite(GainBetween(before, before).low));
}

TEST(Verdict, ExplainedNeedsCausesThatCanBeReliedOnAndLeaveNothing) {
  const Cause alone = CauseWith(kBetter, kNone),
              repeats = CauseWith(kBetter, kNone, "silent", true),
              differs = CauseWith(kBetter, kNone, "silent", false),
              witnessed = CauseWith(kEither, kNone, "confirms", false);
  EXPECT_EQ(VerdictOf({}, {}, {}), "clean");
  EXPECT_EQ(VerdictOf({}, {alone}, {}), "unexplained");
  EXPECT_EQ(VerdictOf({alone}, {}, {}), "explained");
  EXPECT_EQ(VerdictOf({repeats}, {alone}, {}), "explained");
  EXPECT_EQ(VerdictOf({witnessed}, {}, {}), "explained");
  EXPECT_EQ(VerdictOf({differs}, {}, {}), "unexplained");
  EXPECT_EQ(VerdictOf({repeats, differs}, {}, {}), "unexplained");  // differs is a misfit, too
  EXPECT_EQ(VerdictOf({repeats}, {}, {"heading"}), "unexplained");
  Cause confused = repeats;
  confused.confused_with = {"wind"};
  EXPECT_EQ(VerdictOf({confused}, {}, {}), "ambiguous");
}

// Two constants with priors of one, and a cause that is seen through their sum with the first.
Linearisation TwoConstants(double apart) {
  // Rows: (constant 1 + cause) with weight 100, constant 2 with weight 50, the cause alone with
  // weight `apart`.
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(4, 4);
  const Eigen::Vector4d sum(1.0, 0.0, 1.0, 0.0);
  gram += 100.0 * sum * sum.transpose();
  gram(1, 1) += 50.0;
  gram(2, 2) += apart;
  Linearisation fit(
      ReducedSystem({gram}, {Eigen::Vector3d(1.0, 1.0, 0.0), Eigen::Vector3d::Zero()}, 0.0, 0.0));
  fit.nuisances = {0, 1};
  fit.found = {{{2}, Eigen::VectorXd::Ones(1)}};
  return fit;
}

TEST(Confused, ACauseThatOnlyThePriorOfAConstantShows) {
  const Candidate candidate{&InfoOf("fix_scale"), {}};
  const std::vector<Found> found{{candidate, Eigen::VectorXd::Constant(1, 5.0)}};
  EXPECT_THAT(ConfusedConstants(TwoConstants(0.0), found, 0, {"b_ax", "b_ay"}),
              ElementsAre("b_ax"));
  EXPECT_THAT(ConfusedConstants(TwoConstants(10.0), found, 0, {"b_ax", "b_ay"}), IsEmpty());
}

}  // namespace
}  // namespace trueline
