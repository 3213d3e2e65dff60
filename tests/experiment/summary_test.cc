// Intervals and convergence times against known answers.
#include <cmath>

#include "problems/common/random.h"
#include "problems/experiment/accuracy.h"
#include "problems/experiment/write_benchmark.h"
#include "problems/simulation/config.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/vgd.h"
#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

TEST(Bootstrap, IntervalOfAMeanIsThatOfTheNormal) {
  Random random(1);
  std::vector<std::vector<double>> flights(400);
  std::vector<double> means;
  for (auto& flight : flights) {
    const double shared = random.Normal();  // common to all arcs of one flight
    for (int i = 0; i < 5; ++i) flight.push_back(3.0 + shared + 0.1 * random.Normal());
    means.push_back(Mean(flight));
  }
  const double centre = Mean(means);
  double variance = 0.0;
  for (const double m : means) variance += (m - centre) * (m - centre) / (means.size() - 1);
  const double half = 1.96 * std::sqrt(variance / means.size());
  const auto interval = BootstrapInterval(flights, Mean);
  ASSERT_TRUE(interval.has_value());
  EXPECT_NEAR(interval->low, centre - half, 0.1 * half);
  EXPECT_NEAR(interval->high, centre + half, 0.1 * half);
}

TEST(Bootstrap, NeedsTwoFlights) {
  EXPECT_FALSE(BootstrapInterval({{1.0, 2.0}, {}}, Mean).has_value());
  EXPECT_TRUE(BootstrapInterval({{1.0}, {2.0}}, Mean).has_value());
}

TEST(TimeInside, IsTheTimeFromWhichOnErrorsStaySmall) {
  const std::vector<TimedError> errors = {{1, 0.1}, {2, -0.9}, {3, 0.2}, {4, -0.3}};
  EXPECT_EQ(TimeInside(errors, 0.3), 3.0);
  EXPECT_EQ(TimeInside(errors, 1.0), 1.0);
  EXPECT_TRUE(std::isnan(TimeInside(errors, 0.25)));
  EXPECT_TRUE(std::isnan(TimeInside({}, 1.0)));
  EXPECT_TRUE(std::isnan(TimeInside({{1, std::nan("")}}, 1.0)));
}

WindowEstimate WindowAt(int seconds, double b_az) {
  WindowEstimate window;
  window.end = FromSeconds(seconds);
  window.parameters = {{"b_az", b_az, 0.1, "m/s^2", "identified"}};
  return window;
}

TEST(Convergence, TakesParametersWithKnownTruthAndTimesFromTheFirstFix) {
  const EstimatorRun run{"vgd", 3, {WindowAt(4, 0.5), WindowAt(8, 0.22), WindowAt(12, 0.2)}, {}};
  const auto rows =
      Convergence(run, "VGD", {{"b_az", 0.2}},
                  {{"b_az", 0.05}, {"b_ax", 0.1}, {"final_point_error", 1.0}}, FromSeconds(2));
  ASSERT_EQ(rows.size(), 1U);  // no b_ax, no arcs
  EXPECT_EQ(rows[0].quantity, "b_az");
  EXPECT_NEAR(rows[0].time, 6.0, 1e-9);
}

ArcRow Arc(const std::string& label, double error, bool inside, bool counted) {
  ArcRow arc;
  arc.label = label;
  arc.estimator = "vgd";
  arc.gamma = 3;
  arc.error = error;
  arc.inside_95 = inside;
  arc.counted = counted;
  arc.iterations = 4;
  arc.bound = 0.5;
  return arc;
}

TEST(Summary, PoolsSeedsAndLeavesOutWhatDoesNotCount) {
  std::vector<JobOutcome> outcomes(2);
  outcomes[0].job.log = outcomes[1].job.log = "oval";
  outcomes[0].result.arcs = {Arc("A", 3.0, true, true), Arc("A", 4.0, false, true),
                             Arc("B", 9.0, true, true), Arc("A", 99.0, false, false)};
  outcomes[1].result.arcs = {Arc("A", 5.0, true, true), Arc("A", INFINITY, false, true)};
  const auto groups = SummariseGroups(outcomes);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].label, "A");
  EXPECT_EQ(groups[0].flights, 2);
  EXPECT_EQ(groups[0].error.count, 3);
  EXPECT_EQ(groups[0].diverged, 1);
  EXPECT_DOUBLE_EQ(groups[0].error.mean, 4.0);
  EXPECT_DOUBLE_EQ(groups[0].error.median, 4.0);
  EXPECT_DOUBLE_EQ(groups[0].rms, std::sqrt(50.0 / 3.0));
  EXPECT_DOUBLE_EQ(groups[0].bound_rms, 0.5);
  EXPECT_EQ(groups[0].inside_95, 2);
  EXPECT_EQ(groups[1].flights, 1);
  EXPECT_FALSE(groups[1].mean_interval.has_value());
}

TEST(Summary, MedianTimeIsInfiniteWhereMostFlightsNeverConverge) {
  std::vector<JobOutcome> outcomes(3);
  const double never = std::nan("");
  outcomes[0].result.convergence = {{"A", 3, "b_az", 0.1, 9, 4.0}, {"B", 3, "b_az", 0.1, 9, 8.0}};
  outcomes[1].result.convergence = {{"A", 3, "b_az", 0.1, 9, never}, {"B", 3, "b_az", 0.1, 9, 6.0}};
  outcomes[2].result.convergence = {{"A", 3, "b_az", 0.1, 9, never},
                                    {"B", 3, "b_az", 0.1, 9, never}};
  const auto times = SummariseConvergence(outcomes);
  ASSERT_EQ(times.size(), 2U);
  EXPECT_EQ(times[0].converged, 1);
  EXPECT_TRUE(std::isinf(times[0].median_time));
  EXPECT_EQ(times[1].converged, 2);
  EXPECT_EQ(times[1].median_time, 8.0);
}

// --- VGD on flights for which its model is exact must reach the Cramer-Rao bound, and not beat it.

SimulationConfig ExactHippodrome() {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome_exact", 16.0);
  config.warm_up = 5.0;
  config.imu.rate = 256.0;
  // Table 2's ranges, whose mean and sigma VGD's priors have.
  constexpr double kThreeDegrees = 3.0 * kDegree;
  config.randomise["K_x"] = config.randomise["K_y"] = {-1.0, 0.0};
  config.randomise["b_az"] = {-1.0, 1.0};
  for (const char* angle :
       {"phi_I_B", "theta_I_B", "psi_I_B", "phi_E_Ep", "theta_E_Ep", "psi_E_Ep"}) {
    config.randomise[angle] = {-kThreeDegrees, kThreeDegrees};
  }
  return config;
}

VgdOptions ExactModel() {
  VgdOptions options;
  options.process = ProcessNoise();
  options.drag_measurement.enabled = false;
  options.loss = FixLoss::kNone;
  options.gamma = 3;
  return options;
}

Theta TruthOf(const SimulationConfig& c) {
  const auto values = TunableValues(c);
  Theta theta;
  for (int i = 0; i < kMotionSize; ++i) theta[i] = values.at(kTheta[i].name);
  return theta;
}

FlightData DataOf(const FlightLog& log, const VgdOptions& options) {
  return FlightData(log, options.drive, options.passes, options.drag_measurement);
}

TEST(FinalPointBoundTest, VgdReachesTheBoundOnAnExactModel) {
  constexpr int kSeeds = 60;
  const VgdOptions options = ExactModel();
  double ratio_sum = 0.0;
  int arcs = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const SimulationConfig config = DrawVariant(ExactHippodrome(), seed);
    const FlightLog log = Simulate(config, seed);
    const FlightData flight = DataOf(log, options);
    constexpr int kTau = 3;
    ASSERT_TRUE(flight.HasArc(kTau));
    const WindowEstimate fit = SolveWindow(flight, options, kTau, PriorMeans(options));
    const Eigen::Matrix2d bound = FinalPointBound(flight, options, kTau, TruthOf(config));
    ratio_sum += fit.arc->FinalPointError() * fit.arc->FinalPointError() / bound.trace();
    ++arcs;
  }
  // The mean of e'e / trace has a relative sigma of 1 to sqrt(2) for one arc (two to one
  // directions), so for 60 arcs it lies within 1 +- 0.37 with 95 %.
  const double ratio = ratio_sum / arcs;
  std::printf("mean squared error over bound: %.3f (%d arcs)\n", ratio, arcs);
  EXPECT_GT(ratio, 0.63);
  EXPECT_LT(ratio, 1.37);
}

TEST(FinalPointBoundTest, FallsWithTheFixesSigmaAndGrowsWithProcessNoise) {
  const SimulationConfig config = ExactHippodrome();
  FlightLog log = Simulate(config, 1);
  const VgdOptions options = ExactModel();
  const auto bound = [&](const VgdOptions& o) {
    return LeastFinalPointError(FinalPointBound(DataOf(log, o), o, 3, TruthOf(config)));
  };
  const double base = bound(options);
  VgdOptions noisy = options;
  noisy.process = VgdOptions().process;
  EXPECT_GT(bound(noisy), 1.1 * base);
  for (Fix& fix : log.fixes) fix.sigma *= 0.5;
  const double halved = bound(options);
  EXPECT_LT(halved, base);
  EXPECT_GT(halved, 0.5 * base);  // the prior's information does not change
}

// With fixes only and theta known, the bound is that of the end of a straight-line fit; computed
// here for one axis.
TEST(FinalPointBoundTest, KnownParametersGiveTheStraightLinesBound) {
  FlightLog log;
  for (int k = 0; k <= 600; ++k) {
    const TimeNs t = FromSeconds(0.01 * k);
    log.imu.push_back({t, {0.0, 0.0, -9.81}, Eigen::Vector3d::Zero()});
    log.attitude.push_back({t, Eigen::Quaterniond::Identity()});
    const double seconds = 0.01 * k;
    if (k % 10 == 5 && (seconds < 2.0 || seconds > 4.0)) {
      log.fixes.push_back({t, {2.0 * seconds, 0.0, 0.0}, 0.1, 0});
    }
  }
  VgdOptions options = ExactModel();
  options.gamma = 1;
  for (ParameterPrior& prior : options.priors) prior = {0.0, 1e-9, -1.0, 1.0};
  const FlightData flight = DataOf(log, options);
  const Eigen::Matrix2d bound = FinalPointBound(flight, options, 1, std::nullopt);
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i <= flight.passes[0].last; ++i) {
    const Eigen::Vector2d row(1.0, ToSeconds(log.fixes[i].t));
    H += row * row.transpose() / 0.01;
  }
  const Eigen::Vector2d end(1.0, ToSeconds(flight.passes[1].begin));
  EXPECT_NEAR(bound(0, 0), end.dot(H.inverse() * end), 1e-6);
  EXPECT_NEAR(bound(1, 1), bound(0, 0), 1e-9);
}

}  // namespace
}  // namespace trueline
