// The verdict on a flight, every reason for it.
#include "problems/calibration/calibration.h"

#include "problems/calibration/conflict.h"
#include "problems/result/statistics.h"
#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

// Twenty windows with arcs, of which `inside` end inside of their ellipse.
EstimatorRun FlownRun(int inside = 19) {
  EstimatorRun run{"vgd", 3, {}, {}};
  for (int tau = 1; tau <= 20; ++tau) {
    WindowEstimate window;
    window.tau = tau;
    window.converged = true;
    window.parameters = {{"K_x", -0.5, 0.1, "1/s", "identified"},
                         {"K_y", -0.5, 0.1, "1/s", "weak"},
                         {"b_az", 0.1, 0.1, "m/s^2", "identified"}};
    window.fitted = {{0, Eigen::Vector3d(0.3 * tau, 0.0, -1.5), Eigen::Vector3d(1.8, 0.0, 0.0)}};
    window.misfits = {{0, 0, Eigen::Vector3d::Zero(), 0.3, 1.0}};
    ArcPrediction arc;
    arc.cov = 0.01 * Eigen::Matrix2d::Identity();
    arc.truth = Eigen::Vector2d(tau <= inside ? 0.1 : 0.5, 0.0);
    arc.truth_source = "mocap";
    window.arc = arc;
    run.windows.push_back(window);
  }
  return run;
}

TEST(Judge, AGoodFlightIsUsableAndWhatIsWrongIsTheReason) {
  const Verdict good = Judge(FlownRun()), none = Judge({"vgd", 3, {}, {}});
  EXPECT_EQ(good.word, "usable");
  EXPECT_THAT(good.reasons, IsEmpty());
  EXPECT_EQ(none.word, "unusable");
  EXPECT_THAT(none.reasons, ElementsAre(HasSubstr("no pass to fit")));
  const auto reasons_with = [](const std::function<void(EstimatorRun*)>& spoil) {
    EstimatorRun run = FlownRun();
    spoil(&run);
    EXPECT_EQ(Judge(run).word, "poor");
    return Judge(run).reasons;
  };
  EXPECT_THAT(reasons_with([](EstimatorRun* r) { r->windows.back().converged = false; }),
              ElementsAre(HasSubstr("did not converge")));
  EXPECT_THAT(
      reasons_with([](EstimatorRun* r) { r->windows.back().parameters[2].status = "at_bound"; }),
      ElementsAre(HasSubstr("b_az ended at the bound")));
  EXPECT_THAT(reasons_with([](EstimatorRun* r) {
                for (WindowEstimate& window : r->windows) window.arc.reset();
              }),
              ElementsAre(HasSubstr("no arc to check the prediction on")));
}

TEST(Judge, AHoverIsUnusable) {
  EstimatorRun run = FlownRun();
  for (WindowEstimate& window : run.windows) window.fitted[0].p_E *= 0.1;
  const Verdict verdict = Judge(run);
  EXPECT_EQ(verdict.word, "unusable");
  EXPECT_THAT(verdict.reasons, ElementsAre(HasSubstr("(hovering)")));
  for (WindowEstimate& window : run.windows) window.misfits[0].sigma = 0.02;
  EXPECT_NE(Judge(run).word, "unusable");  // in a small space, with a drag that is shown
  for (ParameterEstimate& p : run.windows.back().parameters) p.status = "unobservable";
  EXPECT_EQ(Judge(run).word, "unusable");
  run = FlownRun();  // it moves by less than the noise of its fixes
  for (WindowEstimate& window : run.windows) window.misfits[0].sigma = 1.5;
  EXPECT_EQ(Judge(run).word, "unusable");
}

TEST(Judge, FixesThatScatterMoreThanTheyStateArePoor) {
  EstimatorRun run = FlownRun();
  for (WindowEstimate& window : run.windows) window.misfits[0].error.x() = 0.7;  // 1.5 times
  EXPECT_EQ(Judge(run).word, "usable");
  for (WindowEstimate& window : run.windows) window.misfits[0].error.x() = 2.3;
  EXPECT_THAT(Judge(run).reasons, ElementsAre(HasSubstr("scatter 5.0 times as much")));
}

TEST(Judge, NoDragIsPoor) {
  EstimatorRun run = FlownRun();
  for (int i : {0, 1}) run.windows.back().parameters[i].status = "unobservable";
  const Verdict verdict = Judge(run);
  EXPECT_EQ(verdict.word, "poor");
  EXPECT_THAT(verdict.reasons, ElementsAre(HasSubstr("shows no drag")));
  run.windows.back().parameters[0].status = "weak";
  EXPECT_EQ(Judge(run).word, "usable");
}

TEST(Judge, FewArcsArePoor) {
  EstimatorRun run = FlownRun();
  for (std::size_t i = 5; i < run.windows.size(); ++i) run.windows[i].arc.reset();
  EXPECT_EQ(Judge(run).word, "usable");
  run.windows[4].arc.reset();
  EXPECT_THAT(Judge(run).reasons, ElementsAre(HasSubstr("too few arcs")));
}

TEST(Judge, ManyFalsePassesArePoor) {
  EstimatorRun run = FlownRun();
  run.false_passes = {1};
  EXPECT_EQ(Judge(run).word, "usable");
  for (std::size_t k = 2; k < run.windows.size() / 2; ++k) {
    run.false_passes.push_back(static_cast<int>(k));
  }
  run.false_passes.push_back(static_cast<int>(run.windows.size()) - 1);
  const Verdict verdict = Judge(run);
  EXPECT_EQ(verdict.word, "poor");
  EXPECT_THAT(verdict.reasons, ElementsAre(HasSubstr("passes look false")));
}

TEST(Judge, ForcesAndDriftsOfNoVehicleArePoor) {
  WholeFlight whole;
  whole.strengths = {{"acceleration", 0.9, 0.8, 1.0, "m/s^2/sqrt(Hz)"},
                     {"thrust", 0.9, 0.8, 1.0, "m/s^2/sqrt(Hz)"},
                     {"tilt_drift", 0.1, 0.08, 0.12, "rad"}};
  Verdict verdict{"usable", {}};
  JudgeStrengths(whole, &verdict);
  EXPECT_EQ(verdict.word, "usable");
  whole.strengths[0].value = 13.8;
  whole.strengths[1].value = 1.5;
  whole.strengths[2].value = 0.6;
  JudgeStrengths(whole, &verdict);
  EXPECT_EQ(verdict.word, "poor");
  EXPECT_THAT(verdict.reasons,
              ElementsAre(HasSubstr("acceleration of 14"), HasSubstr("thrust of 1.5"),
                          HasSubstr("tilt_drift of 0.6")));
}

// A run of 18 windows of three passes under a prior of K_x, whose data alone say `data`.
EstimatorRun RunThatShows(double prior_sigma, double data, double data_sigma) {
  const double precision = std::pow(prior_sigma, -2) + std::pow(data_sigma, -2);
  EstimatorRun run{"vgd", 3, {}, {}};
  for (int tau = 1; tau <= 18; ++tau) {
    WindowEstimate window;
    window.gamma = 3;
    const double mean =
        (0.01 * std::pow(prior_sigma, -2) + data * std::pow(data_sigma, -2)) / precision;
    window.parameters = {{"K_x", mean, 1.0 / std::sqrt(precision), "1/s", "identified"}};
    run.windows.push_back(window);
  }
  return run;
}

MotionPriors PriorsWithSigma(double sigma) {
  auto priors = DefaultPriors();
  priors[0] = {0.01, sigma, -2.0, 2.0};
  return priors;
}

std::vector<Statements> ConflictsWith(double prior_sigma, const EstimatorRun& run) {
  const MotionPriors priors = PriorsWithSigma(prior_sigma);
  return ContradictionsAmong(CompareWithModel(priors, priors, IndependentEstimates(run)));
}

std::vector<Statements> ConflictOf(double prior_sigma, double data, double data_sigma) {
  return ConflictsWith(prior_sigma, RunThatShows(prior_sigma, data, data_sigma));
}

TEST(PriorConflict, ASharpPriorThatTheFlightContradictsIsReported) {
  const std::vector<Statements> conflicts = ConflictOf(0.03, -0.35, 0.15);
  ASSERT_EQ(conflicts.size(), 1U);
  EXPECT_EQ(conflicts[0].name, "K_x");
  EXPECT_NEAR(conflicts[0].other, -0.35, 1e-9);
  EXPECT_NEAR(conflicts[0].other_sigma, 0.15 / std::sqrt(6.0), 1e-9);  // six windows apart
}

TEST(PriorConflict, AnOrdinaryDifferenceIsNone) {
  EXPECT_THAT(ConflictOf(0.03, -0.15, 0.15), IsEmpty());  // 2.3 sigmas
  EXPECT_THAT(ConflictOf(0.3, -0.9, 0.15), IsEmpty());    // 3 sigmas
}

// Each estimate of a smoother holds all data before it: 18 of them are no six flights.
TEST(PriorConflict, EstimatesThatCarryThePastCountOnce) {
  EstimatorRun run = RunThatShows(0.03, -0.35, 0.15);
  run.estimator = "smoother";
  EXPECT_THAT(ConflictsWith(0.03, run), IsEmpty());
}

std::vector<std::string> TextsFor(double model, double model_sigma, double data) {
  const MotionPriors wide = PriorsWithSigma(0.3), sharp = [&] {
    MotionPriors priors = PriorsWithSigma(model_sigma);
    priors[0].mean = model;
    return priors;
  }();
  return WhyModelIsNotUsed(
      CompareWithModel(sharp, wide, IndependentEstimates(RunThatShows(0.3, data, 0.06))));
}

TEST(PriorConflict, StatesWhatTheFlightShowsWithoutTheModel) {
  EXPECT_THAT(TextsFor(-0.1, 0.01, -0.3),
              ElementsAre(HasSubstr("the model's K_x of -0.1 +- 0.01 1/s contradicts this flight, "
                                    "which alone shows -0.3 +- 0.024:")));
}

TEST(PriorConflict, ConstantsThatOnlyTogetherContradictTheFlightAreSaidTo) {
  EXPECT_THAT(TextsFor(-0.25, 0.01, -0.3),
              ElementsAre(HasSubstr("the model's K_x of -0.25 +- 0.01 1/s and its other constants "
                                    "together contradict this flight, which alone shows -0.3")));
}

// The flight shows the sum of two levers by 0.1, and each by 1.
TEST(PriorConflict, ASumThatTheFlightShowsContradictsTheModel) {
  const auto contradict = [](double r_BM, double r_BP) {
    Eigen::Matrix2d correlations;
    correlations << 1.0, -0.995, -0.995, 1.0;
    return ContradictTogether(
        {{"r_BM_x", "m", 0.0, 0.05, r_BM, 1.0}, {"r_BP_x", "m", 0.0, 0.05, r_BP, 1.0}},
        correlations);
  };
  EXPECT_TRUE(contradict(0.6, 0.6));
  EXPECT_FALSE(contradict(0.15, 0.15));
  EXPECT_FALSE(contradict(3.0, -3.0));
  EXPECT_TRUE(contradict(4.1, -4.1));
  EXPECT_FALSE(ContradictTogether({}, {}));
}

const FlightLog& FlyHippodrome() {
  static const FlightLog log = testing_simulation::LogOf("hippodrome", 30.0, 3);
  return log;
}

// The model's priors of these parameters are what the flight shows.
void TakeAsModel(const Calibration& shown, const std::vector<int>& parameters, double sigma,
                 CalibrationOptions* options) {
  for (const int i : parameters) {
    ParameterPrior& prior = options->methods.vgd.priors[i];
    prior.mean = shown.Reported().windows.back().parameters[i].value;
    prior.sigma = sigma;
  }
}

// A wrong prior moves the constants that are correlated with it. The warning states the flight's
// own values, and names what differs from those.
TEST(Calibrate, StatesWhatTheFlightAloneShowsBesideAWrongModel) {
  const FlightLog log = FlyHippodrome();
  CalibrationOptions options;
  options.gamma_sweep = {};
  const MotionPriors open = options.methods.vgd.priors;
  const Calibration alone = Calibrate(log, options);
  options.priors_without_model = open;
  TakeAsModel(alone, {InTheta("K_x"), InTheta("b_az")}, 0.02, &options);
  options.methods.vgd.priors[InTheta("b_az")].mean += 1.0;
  const Calibration calibration = Calibrate(log, options);
  EXPECT_EQ(calibration.warnings,
            WhyModelIsNotUsed(CompareWithModel(options.methods.vgd.priors, open,
                                               IndependentEstimates(alone.Reported()))));
  EXPECT_THAT(calibration.warnings, ElementsAre(HasSubstr("the model's b_az of")));
}

// A drag of the model that the vehicle does not have pushes the constants away from the model's,
// which hold.
TEST(Calibrate, LeavesOutEffectsThatMakeTheModelContradictTheFlight) {
  const FlightLog log = FlyHippodrome();
  CalibrationOptions options;
  options.gamma_sweep = {};
  options.priors_without_model = options.methods.vgd.priors;
  const Calibration alone = Calibrate(log, options);
  TakeAsModel(alone, {InTheta("K_x"), InTheta("K_y")}, 0.01, &options);
  options.effects = {{"quadratic_drag", {{"c", 0.5}}}};
  options.methods.vgd.drive.force_effects = ForceEffectsOf(options.effects);
  const Calibration calibration = Calibrate(log, options);
  EXPECT_THAT(calibration.effects, IsEmpty());
  EXPECT_THAT(calibration.warnings,
              ElementsAre(HasSubstr("the effects are not used (quadratic_drag (c 0.5 1/m))")));
  EXPECT_LT(calibration.Reported().windows.back().parameters[InTheta("K_x")].sigma, 0.0101);
}

std::vector<ParameterEstimate> EstimatesThatShow(double data, double data_sigma) {
  return RunThatShows(0.3, data, data_sigma).windows.back().parameters;
}

TEST(ConflictsBetween, TwoVehiclesDifferByMoreThanTheirFlightsShow) {
  const auto priors = PriorsWithSigma(0.3);
  const auto light = EstimatesThatShow(-0.3, 0.06), heavy = EstimatesThatShow(-0.7, 0.06);
  const std::vector<Statements> conflicts = ConflictsBetween(priors, light, heavy);  // 4.7 sigmas
  ASSERT_EQ(conflicts.size(), 1U);
  EXPECT_EQ(conflicts[0].name, "K_x");
  EXPECT_NEAR(conflicts[0].other, -0.7, 1e-9);
  EXPECT_THAT(ConflictsBetween(priors, light, EstimatesThatShow(-0.6, 0.06)), IsEmpty());
}

// The estimate is said to show almost nothing, because its sigma was widened to nearly the prior's.
TEST(ConflictsBetween, AWidenedSigmaDoesNotMoveWhatTheDataShow) {
  auto wide = EstimatesThatShow(-0.2, 0.06);
  wide[0].model_sigma = wide[0].sigma;
  wide[0].sigma = 0.29;
  EXPECT_THAT(ConflictsBetween(PriorsWithSigma(0.3), wide, EstimatesThatShow(-0.3, 0.01)),
              IsEmpty());
}

TEST(Judge, TooManyOutsideOfTheirEllipseIsPoor) {
  const Verdict verdict = Judge(FlownRun(12));
  EXPECT_EQ(verdict.word, "poor");
  EXPECT_THAT(verdict.reasons,
              ElementsAre(HasSubstr("the stated uncertainty is too small: 12 of 20")));
  EXPECT_EQ(Judge(FlownRun(17)).word, "usable");  // chance explains 17 of 20 (probability 7 %)
}

TEST(Judge, FewArcsAreUsableOnlyIfNearlyAllAreInside) {
  const auto flown = [](int inside, std::size_t count) {
    EstimatorRun run = FlownRun(inside);
    for (std::size_t i = count; i < run.windows.size(); ++i) run.windows[i].arc.reset();
    return run;
  };
  const auto word = [&](int inside, std::size_t count) { return Judge(flown(inside, count)).word; };
  EXPECT_EQ(word(5, 5), "usable");
  EXPECT_EQ(word(3, 5), "poor");
  EXPECT_EQ(word(4, 4), "poor");
  EXPECT_EQ(word(5, 6), "poor");
  EXPECT_EQ(word(7, 8), "usable");
  EXPECT_THAT(Judge(flown(3, 5)).reasons, ElementsAre(HasSubstr("too few arcs")));
}

TEST(SummariseArcs, CountsErrorsAndEllipses) {
  const ArcSummary arcs = SummariseArcs(FlownRun(15));
  EXPECT_EQ(arcs.error.count, 20);
  EXPECT_EQ(arcs.inside_95, 15);
  EXPECT_NEAR(arcs.error.mean, (15 * 0.1 + 5 * 0.5) / 20, 1e-12);
  EXPECT_NEAR(arcs.error.median, 0.1, 1e-12);
  EXPECT_NEAR(arcs.error.p95, 0.5, 1e-12);
  EXPECT_NEAR(arcs.Coverage(), 0.75, 1e-12);
}

TEST(SummariseArcs, MocapOutranksFixesAsTruth) {
  EstimatorRun run = FlownRun(20);
  for (int i = 0; i < 5; ++i) run.windows[i].arc->truth_source = "fixes";
  run.windows[7].arc->truth.reset();
  EXPECT_EQ(SummariseArcs(run).error.count, 14);
}

// Fixes of a receiver are late. A fit that estimates by how much has no fault to report.
TEST(JudgeLog, ADelayThatTheFitFindsIsNoFault) {
  const LogFault late{
      "log", &fault::kClockOffset, "fixes", 0.11, false, "clock_offset: fixes come 0.110 s later"};
  FlightLog log;
  log.directory = "log";
  const auto reasons = [&](const std::vector<StreamDelay>& delays, const LogFault& fault) {
    Verdict verdict{"usable", {}};
    JudgeLog(log, {fault}, delays, &verdict);
    return verdict.reasons.size();
  };
  EXPECT_EQ(reasons({{"fixes", 0.126, 0.022}}, late), 0U);
  EXPECT_EQ(reasons({{"fixes", 0.3, 0.022}}, late), 1U);   // contradicts it
  EXPECT_EQ(reasons({{"pose", 0.126, 0.022}}, late), 1U);  // another stream
  EXPECT_EQ(reasons({}, late), 1U);
  EXPECT_EQ(
      reasons({{"fixes", 0.126, 0.022}}, {"log", &fault::kStuck, "fixes", 0.11, false, "stuck: x"}),
      1U);
  // The delay is that of the first flight.
  LogFault of_other = late;
  of_other.log = "other";
  Verdict verdict{"usable", {}};
  JudgeLog(log, {of_other}, {{"fixes", 0.126, 0.022}}, &verdict);
  EXPECT_THAT(verdict.reasons, ElementsAre(testing::StartsWith("other has a fault")));
}

TEST(ArcPrediction, EllipseFollowsTheCovariance) {
  ArcPrediction arc;
  arc.cov << 1.0, 0.9, 0.9, 1.0;
  arc.truth = Eigen::Vector2d(2.0, 2.0);  // along the long axis: 2.1 sigma
  EXPECT_TRUE(arc.Inside95());
  arc.truth = Eigen::Vector2d(1.0, -1.0);  // across it: 4.5 sigma
  EXPECT_FALSE(arc.Inside95());
  EXPECT_NEAR(arc.FinalPointError(), std::sqrt(2.0), 1e-12);
}

TEST(Statistics, KnowTheirTables) {
  EXPECT_NEAR(BinomialCdf(17, 20, 0.95), 0.0755, 1e-4);
  EXPECT_NEAR(BinomialCdf(20, 20, 0.95), 1.0, 1e-12);
  EXPECT_NEAR(Quantile({3, 1, 2, 4}, 0.5), 2.5, 1e-12);
  EXPECT_NEAR(Quantile({3, 1, 2, 4}, 1.0), 4.0, 1e-12);
  EXPECT_TRUE(std::isnan(Mean({})));
}

}  // namespace
}  // namespace trueline
