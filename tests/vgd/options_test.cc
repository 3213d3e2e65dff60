// Effects of the fit's options: losses, solvers, the stopping rule of eq. 36, bounds, gaps.
#include "problems/vgd/solver_options.h"
#include "tests/common/matchers.h"
#include "tests/vgd/flights.h"

namespace trueline::testing_vgd {
namespace {

// Root mean square of (value - truth) in prior sigmas.
double Miss(const WindowEstimate& window, const SimulationConfig& config,
            const VgdOptions& options) {
  const Theta truth = TrueTheta(config);
  double sum = 0.0;
  for (int i = 0; i < kMotionSize; ++i) {
    sum += std::pow((window.parameters[i].value - truth[i]) / options.priors[i].sigma, 2);
  }
  return std::sqrt(sum / kMotionSize);
}

TEST(Losses, RobustOnesWithstandOutliers) {
  VgdOptions options = RigidOptions();
  SimulationConfig config = ExactHippodrome(20.0);
  config.detector.sigma_factor = 0.02;
  config.detector.outlier_share = 0.1;
  const Flight flight(config, 4, options);
  const double none = Miss(SolveLast(flight, options), config, options);
  for (const FixLoss loss : {FixLoss::kHuber, FixLoss::kCauchy, FixLoss::kNorm}) {
    options.loss = loss;
    const WindowEstimate window = SolveLast(flight, options);
    EXPECT_TRUE(window.converged) << "loss " << int(loss);
    EXPECT_LT(Miss(window, config, options), 0.6 * none) << "loss " << int(loss);
    const auto outliers =
        std::count_if(window.misfits.begin(), window.misfits.end(),
                      [](const FixMisfit& m) { return m.error.norm() > 20.0 * m.sigma; });
    ASSERT_GT(outliers, 0);
    for (const FixMisfit& m : window.misfits) {
      EXPECT_LT(m.error.norm() > 20.0 * m.sigma ? m.weight : 0.0, 0.2);
    }
  }
}

TEST(Losses, WeightsAreTheSlopesOfTheLosses) {
  EXPECT_NEAR(RobustWeight(FixLoss::kHuber, 2.0, 1.9), 1.0, 1e-12);
  EXPECT_NEAR(RobustWeight(FixLoss::kHuber, 2.0, 4.0), 0.5, 1e-12);
  EXPECT_NEAR(RobustWeight(FixLoss::kCauchy, 2.0, 2.0), 0.5, 1e-12);
  EXPECT_NEAR(RobustWeight(FixLoss::kNorm, 2.0, 4.0), 0.25, 1e-6);
  EXPECT_EQ(RobustWeight(FixLoss::kNone, 2.0, 4.0), 1.0);
}

TEST(Solvers, SlowGradientDescentApproachesTheTrustRegionsOptimum) {
  VgdOptions options = RigidOptions();
  options.gamma = 2;
  const Flight flight(ExactHippodrome(12.0), 4, options);
  const double best = SolveLast(flight, options).cost;
  options.solver = VgdSolver::kGradientDescent;
  options.tolerance = 1e-9;
  double before = std::numeric_limits<double>::infinity();
  for (const int iterations : {3, 30, 1000}) {
    options.max_iterations = iterations;
    const WindowEstimate window = SolveLast(flight, options);
    EXPECT_LE(window.iterations, iterations);
    EXPECT_LT(window.cost, before);
    EXPECT_GT(window.cost, 0.999 * best);
    before = window.cost;
  }
  EXPECT_LT(before, 1.25 * best);
}

// The search stops at |J_k - J_{k-1}| / J_k <= 1e-4, and not earlier.
TEST(Solvers, StopByEq36) {
  const VgdOptions options = RigidOptions();
  const Flight flight(ExactHippodrome(16.0), 4, options);
  const int tau = static_cast<int>(flight.data.passes.size());
  const int first = flight.data.FirstPassOf(tau, options.gamma, options.min_window_fixes);
  const WindowData data = CutWindow(flight.data, options, first, tau, false);
  WindowProblem problem(flight.data.track, data, options);
  problem.SetStart(PriorMeans(options), RoughPath(flight.data.log.fixes, data.passes));
  const ceres::Solver::Summary summary = problem.Solve();
  ASSERT_EQ(summary.termination_type, ceres::CONVERGENCE);
  ASSERT_GE(summary.iterations.size(), 3U);
  for (std::size_t k = 1; k < summary.iterations.size(); ++k) {
    if (!summary.iterations[k].step_is_successful) continue;
    const double change =
        std::abs(summary.iterations[k].cost_change) / summary.iterations[k - 1].cost;
    EXPECT_GT(change, 1e-4);  // the last step, which is below, is not listed
  }
  EXPECT_THAT(summary.message, HasSubstr("Function tolerance reached"));
  EXPECT_THAT(summary.message, HasSubstr("<= 1.000000e-04"));
}

TEST(Bounds, AParameterThatEndsOnOneIsReported) {
  VgdOptions options = RigidOptions();
  options.priors[0] = {-0.2, 0.29, -0.3, 0.0};  // the truth is -0.5
  SimulationConfig config = ExactHippodrome(20.0);
  config.detector.sigma_factor = 0.01;
  const WindowEstimate window = SolveLast(Flight(config, 4, options), options);
  EXPECT_NEAR(window.parameters[0].value, -0.3, 1e-9);
  EXPECT_EQ(window.parameters[0].status, "at_bound");
  EXPECT_NE(window.parameters[2].status, "at_bound");
}

// An IMU gap on the arc: the arc is not predicted, with a warning, and no window spans the gap.
TEST(Gaps, EndWindows) {
  const VgdOptions options = RigidOptions();
  SimulationConfig config = ExactHippodrome(30.0);
  testing_simulation::Flown flown = testing_simulation::Fly(config, 4);
  const std::vector<Pass> passes = FindPasses(flown.log.fixes, options.passes);
  ASSERT_GE(passes.size(), 6U);
  std::erase_if(flown.log.imu, [&](const ImuSample& s) {
    return s.t > passes[2].end + kNsPerSecond / 10 && s.t < passes[3].begin - kNsPerSecond / 10;
  });
  const FlightData data(flown.log, options.drive, options.passes, options.drag_measurement);
  const EstimatorRun run = RunVgd(data, options);
  ASSERT_EQ(run.windows.size(), passes.size());
  EXPECT_FALSE(run.windows[2].arc.has_value());
  EXPECT_TRUE(run.windows[1].arc && run.windows[3].arc);
  EXPECT_EQ(run.windows[2].gamma, 3);
  EXPECT_EQ(run.windows[3].gamma, 1);
  EXPECT_EQ(run.windows[4].gamma, 2);
  EXPECT_THAT(run.warnings, ElementsAre(HasSubstr("the arc after pass 3")));
}

TEST(Gaps, InsideAPassLeaveItOut) {
  const VgdOptions options = RigidOptions();
  testing_simulation::Flown flown = testing_simulation::Fly(ExactHippodrome(20.0), 4);
  const std::vector<Pass> passes = FindPasses(flown.log.fixes, options.passes);
  const TimeNs middle = (passes[1].begin + passes[1].end) / 2;
  std::erase_if(flown.log.imu,
                [&](const ImuSample& s) { return std::abs(s.t - middle) < kNsPerSecond * 3 / 10; });
  const FlightData data(flown.log, options.drive, options.passes, options.drag_measurement);
  EXPECT_EQ(data.passes.size(), passes.size() - 1);
  EXPECT_THAT(data.warnings, ElementsAre(HasSubstr("is left out: imu.csv or")));
  for (const WindowEstimate& window : RunVgd(data, options).windows) EXPECT_TRUE(window.converged);
}

// Fixes, forces, drift: with everything on, the default options agree with the truth of their own
// kind of flight about the AHRS error.
TEST(Defaults, FindTheAhrsErrorOfANoisyFlight) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 20.0);
  config.ahrs.kind = simulation::AhrsKind::kConstantError;
  config.ahrs.constant = {0.03, -0.02, 0.0};
  const VgdOptions options;
  const Flight flight(config, 2, options);
  const EstimatorRun run = RunVgd(flight.data, options);
  const ParameterEstimate& phi = Find(run.windows.back(), "phi_E_Ep");
  const ParameterEstimate& theta = Find(run.windows.back(), "theta_E_Ep");
  EXPECT_NEAR(phi.value, 0.03, 3.0 * phi.sigma);
  EXPECT_NEAR(theta.value, -0.02, 3.0 * theta.sigma);
  EXPECT_LT(phi.sigma, 0.02);
}

}  // namespace
}  // namespace trueline::testing_vgd
