// VGD on flights for which its model is exact must reach the Cramer-Rao bound, and not beat it.
#include <gtest/gtest.h>

#include "problems/experiment/accuracy.h"
#include "problems/simulation/simulate.h"
#include "problems/simulation/variant.h"
#include "problems/vgd/vgd.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

SimulationConfig ExactHippodrome() {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome_exact");
  config.duration = 16.0;
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
