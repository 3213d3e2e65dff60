// What a diagnosis may say of causes with given evidence.
#include "problems/diagnosis/rules.h"

#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/linearisation.h"
#include "problems/diagnosis/log_faults.h"
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

// --- What faults of the log leave of a verdict.

std::string JudgedWith(const std::string& verdict, const LogFault& fault) {
  Diagnosis diagnosis;
  diagnosis.verdict = verdict;
  AddLogFaults({fault}, &diagnosis);
  EXPECT_THAT(diagnosis.log_faults, ElementsAre(fault.text));
  return diagnosis.verdict;
}

TEST(LogFaults, AFatalFaultExplainsNothing) {
  const LogFault axes{"log", &fault::kAccelerometerAxes,
                      "",    0.0,
                      true,  "accelerometer_axes: x and y are exchanged"};
  EXPECT_EQ(JudgedWith("clean", axes), "unexplained");
  EXPECT_EQ(JudgedWith("explained", axes), "unexplained");
}

TEST(LogFaults, AFatalFaultLeavesNoEffectInTheModel) {
  Diagnosis diagnosis;
  diagnosis.in_model = {Effect{}};
  diagnosis.open.described.resize(1);
  diagnosis.open.described[0].in_model = true;
  AddLogFaults({{"log", &fault::kStuck, "", 0.0, false, "stuck"}}, &diagnosis);
  EXPECT_EQ(diagnosis.in_model.size(), 1U);
  AddLogFaults({{"log", &fault::kAccelerometerAxes, "", 0.0, true, "accelerometer_axes"}},
               &diagnosis);
  EXPECT_TRUE(diagnosis.in_model.empty());
  EXPECT_FALSE(diagnosis.open.described[0].in_model);
  EXPECT_THAT(diagnosis.model_lacks, HasSubstr("fatal"));
}

TEST(LogFaults, AnotherFaultIsNotClean) {
  const LogFault stuck{"log", &fault::kStuck, "", 0.0, false, "stuck: mocap.csv stands still"};
  EXPECT_EQ(JudgedWith("clean", stuck), "unexplained");
  EXPECT_EQ(JudgedWith("explained", stuck), "explained");
}

TEST(LogFaults, WhatTheCatalogueStatesIsJudgedByTheSearch) {
  const LogFault scale{"log", &fault::kAccelerometerScale, "", 0.0,
                       false, "accelerometer_scale: 0.9"};
  EXPECT_EQ(JudgedWith("clean", scale), "clean");
  EXPECT_EQ(JudgedWith("ambiguous", scale), "ambiguous");
}

TEST(LogFaults, NoneLeaveTheVerdict) {
  Diagnosis diagnosis;
  diagnosis.verdict = "clean";
  AddLogFaults({}, &diagnosis);
  EXPECT_EQ(diagnosis.verdict, "clean");
}

TEST(LogFaults, AFurtherFlightThatIsWrongConfirmsNothing) {
  std::vector<FlightLog> logs(3);
  const char* const names[] = {"a", "b", "c"};
  for (std::size_t i = 0; i < logs.size(); ++i) logs[i].directory = names[i];
  logs[2].warnings = {"stuck (biases): x"};
  std::vector<LogFault> faults = {{"a", &fault::kStuck, "mocap", 0.0, false, "stuck: a"},
                                  {"b", &fault::kClockOffset, "imu", 1.0, true, "clock_offset: b"},
                                  {"c", &fault::kStuck, "imu", 0.0, false, "stuck: c"}};
  LeaveOutFaultyFlights(&logs, &faults);
  ASSERT_EQ(logs.size(), 2U);
  EXPECT_EQ(logs[1].directory, "c");
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].log, "a");
  EXPECT_THAT(logs[0].warnings,
              UnorderedElementsAre("c: stuck (biases): x", HasSubstr("b: has a")));
}

}  // namespace
}  // namespace trueline