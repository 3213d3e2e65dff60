// What a diagnosis may say of causes with given evidence.
#include "problems/diagnosis/rules.h"

#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/linearisation.h"
#include "tests/common/matchers.h"

namespace trueline {
namespace {

Gain GainOf(double before, double after, double low, double high) {
  return Gain{20, before, after, low, high};
}

const Gain kBetter = GainOf(0.3, 0.2, 0.05, 0.15), kWorse = GainOf(0.2, 0.3, -0.15, -0.05),
           kSlightlyWorse = GainOf(0.20, 0.21, -0.05, 0.03),
           kEither = GainOf(0.2, 0.199, -0.1, 0.1), kNone;

constexpr double kAlpha = 0.01;

Cause CauseWith(const EvidenceSum& evidence, const std::string& witness = "silent",
                std::optional<bool> confirmed = {}) {
  Cause cause{{}, {}, {}, 1e-13, {}, {kNone, kNone}, {}, confirmed};
  cause.evidence = evidence;
  cause.witness.says = witness;
  return cause;
}

std::string Why(const EvidenceSum& evidence) { return WhyNotNamed(CauseWith(evidence), kAlpha); }

TEST(ClearLoss, NeedsOneMeasureThatIsWorseAndNoneThatIsBetter) {
  EXPECT_TRUE(ClearLoss({kWorse, kNone}));
  EXPECT_TRUE(ClearLoss({kWorse, kEither}));
  EXPECT_FALSE(ClearLoss({kWorse, kBetter}));
  EXPECT_FALSE(ClearLoss({kSlightlyWorse, kEither}));
  EXPECT_FALSE(ClearLoss({kNone, kNone}));
}

// log(1 / 0.01) is 4.6.
TEST(Rules, TheSumOfTheEvidenceDecides) {
  EXPECT_EQ(Why({.flight = 8.0, .prior = -3.0}), "");
  EXPECT_THAT(Why({.flight = 7.0, .prior = -3.0}), HasSubstr("evidence is 4.0"));
  EXPECT_EQ(Why({.flight = 5.0, .witness = 3.0, .prior = -3.0}), "");
  EXPECT_EQ(Why({.flight = 5.0, .other_flights = 3.0, .prior = -3.0}), "");
  EXPECT_THAT(Why({.flight = 11.0, .witness = -6.0, .prior = -3.0}), HasSubstr("witness -6.0"));
}

TEST(Rules, RefutedIsWhatTheFlightShowsAndAnotherSourceExcludes) {
  EXPECT_TRUE(Refuted(CauseWith({.flight = 11.0, .witness = -6.0, .prior = -3.0}), kAlpha));
  EXPECT_TRUE(Refuted(CauseWith({.flight = 11.0, .other_flights = -6.0, .prior = -3.0}), kAlpha));
  EXPECT_FALSE(Refuted(CauseWith({.flight = 5.0, .witness = -6.0, .prior = -3.0}), kAlpha));
  EXPECT_FALSE(Refuted(CauseWith({.flight = 11.0, .witness = -1.0, .prior = -3.0}), kAlpha));
}

// A mean of 0.1 whose two-sided 95 % interval holds zero narrowly, and clearly.
TEST(Rules, AGainIsPositiveWith95PercentOnOneSide) {
  EXPECT_TRUE(ClearGain({GainOf(0.3, 0.2, -0.01, 0.21), kNone}));
  EXPECT_FALSE(ClearGain({GainOf(0.3, 0.2, -0.03, 0.23), kNone}));
}

TEST(Verdict, ExplainedNeedsCausesThatCanBeReliedOnAndLeaveNothing) {
  const EvidenceSum shown{.flight = 11.0, .prior = -3.0}, weak{.flight = 6.0, .prior = -3.0},
      excluded{.flight = 11.0, .witness = -9.0, .prior = -3.0};
  const Cause alone = CauseWith(shown), repeats = CauseWith(shown, "silent", true),
              differs = CauseWith(shown, "silent", false),
              witnessed = CauseWith(shown, "confirms", false);
  const auto verdict = [](const std::vector<Cause>& causes, const std::vector<Cause>& aside,
                          const std::vector<std::string>& by) {
    return VerdictOf(causes, aside, by, kAlpha);
  };
  EXPECT_EQ(verdict({}, {}, {}), "clean");
  EXPECT_EQ(verdict({}, {CauseWith(weak)}, {}), "clean");  // no more than chance
  EXPECT_EQ(verdict({}, {CauseWith(excluded)}, {}), "unexplained");
  EXPECT_EQ(verdict({alone}, {}, {}), "explained");
  EXPECT_EQ(verdict({witnessed}, {}, {}), "explained");
  EXPECT_EQ(verdict({differs}, {}, {}), "unexplained");
  EXPECT_EQ(verdict({repeats, differs}, {}, {}), "unexplained");  // differs is a misfit, too
  EXPECT_EQ(verdict({repeats}, {}, {"heading"}), "unexplained");
  Cause confused = repeats;
  confused.confused_with = {"wind"};
  EXPECT_EQ(verdict({confused}, {}, {}), "ambiguous");
  // The fit denies it, so that the sum is small, but the gyroscope shows it.
  Cause denied = CauseWith({.flight = -1.0, .witness = 3.0, .prior = -3.0}, "refutes");
  denied.candidate = {&InfoOf("attitude_latency"), {}};
  denied.value = Eigen::VectorXd::Constant(1, -0.005);
  denied.witness.value = Eigen::VectorXd::Constant(1, 0.08);
  denied.witness.sigma = Eigen::VectorXd::Constant(1, 0.002);
  EXPECT_EQ(verdict({}, {denied}, {}), "unexplained");
  denied.witness.independent = false;  // the fit used the same
  EXPECT_EQ(verdict({}, {denied}, {}), "clean");
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
