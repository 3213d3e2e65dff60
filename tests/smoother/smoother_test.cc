// The fixed-lag smoother: refused input, breaks, causality.
#include "problems/smoother/smoother.h"

#include "problems/calibration/calibration.h"
#include "tests/common/test_files.h"
#include "tests/vgd/flights.h"

namespace trueline::testing_vgd {
namespace {

SimulationConfig Hippodrome(double duration) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome", duration);
  config.warm_up = 5.0;
  return config;
}

// Without the accelerometer's x and y: their drag information gets an extra uncertainty that grows
// with the estimated drag itself.
VgdOptions FixedStrengths() {
  VgdOptions options;
  options.adapt_drift = false;
  options.drag_measurement.enabled = false;
  return options;
}

FlightData DataOf(const FlightLog& log, const VgdOptions& options) {
  return {log, options.drive, options.passes, options.drag_measurement};
}

TEST(Smoother, WithoutProcessNoiseSaysWhatToSet) {
  const Flight flight(Hippodrome(12.0), 1, VgdOptions());
  VgdOptions rigid;
  rigid.process = {};
  EXPECT_THAT(ErrorOf([&] { RunSmoother(flight.data, rigid, SmootherOptions()); }),
              AllOf(HasSubstr("process"), HasSubstr("smoother")));
}

// Data after an arc's start change no digit of its prediction.
TEST(Smoother, PredictsFromThePastOnly) {
  const VgdOptions options = FixedStrengths();
  testing_simulation::Flown flown = testing_simulation::Fly(Hippodrome(25.0), 2);
  const FlightData whole = DataOf(flown.log, options);
  ASSERT_GE(whole.passes.size(), 5U);
  const EstimatorRun before = RunSmoother(whole, options, SmootherOptions());

  FlightLog changed = flown.log;
  constexpr int kTau = 3;
  for (std::size_t i = whole.passes[kTau].first; i < changed.fixes.size(); ++i) {
    changed.fixes[i].p_E += Eigen::Vector3d(2.0, -1.0, 0.5);
  }
  const EstimatorRun after = RunSmoother(DataOf(changed, options), options, SmootherOptions());
  for (int tau = 1; tau <= kTau; ++tau) {
    EXPECT_EQ(before.windows[tau - 1].arc->p_E, after.windows[tau - 1].arc->p_E) << tau;
    EXPECT_EQ(before.windows[tau - 1].arc->cov, after.windows[tau - 1].arc->cov) << tau;
  }
  EXPECT_NE(before.windows[kTau].arc->p_E, after.windows[kTau].arc->p_E);
}

// A gap in the IMU: the path starts anew, the vehicle's parameters are kept.
TEST(Smoother, CarriesParametersOverABreak) {
  const VgdOptions options = FixedStrengths();
  testing_simulation::Flown flown = testing_simulation::Fly(Hippodrome(40.0), 3);
  const FlightData whole = DataOf(flown.log, options);
  ASSERT_GE(whole.passes.size(), 8U);
  constexpr int kBreak = 5;  // passes before it
  const TimeNs from = whole.passes[kBreak - 1].end + FromSeconds(0.2), to = from + FromSeconds(1.0);
  std::erase_if(flown.log.imu, [&](const ImuSample& s) { return s.t > from && s.t < to; });
  std::erase_if(flown.log.attitude, [&](const auto& s) { return s.t > from && s.t < to; });

  const FlightData broken = DataOf(flown.log, options);
  const EstimatorRun run = RunSmoother(broken, options, SmootherOptions());
  EXPECT_FALSE(run.windows[kBreak - 1].arc);
  const WindowEstimate& before = run.windows[kBreak - 1];
  const WindowEstimate& after = run.windows[kBreak];
  ASSERT_TRUE(after.arc);
  EXPECT_EQ(after.gamma, 1);
  // One pass alone leaves drag at its prior; the smoother still has its estimate.
  const WindowEstimate alone = SolveWindow(broken, options, kBreak + 1, PriorMeans(options));
  EXPECT_GT(Find(alone, "K_x").sigma, 1.3 * Find(before, "K_x").sigma);
  EXPECT_LT(Find(after, "K_x").sigma, 1.05 * Find(before, "K_x").sigma);
  for (int tau = kBreak; tau < static_cast<int>(broken.passes.size()) - 1; ++tau) {
    EXPECT_LT(run.windows[tau].arc->FinalPointError(), 1.2) << tau;  // m
  }
}

// More flight never makes the vehicle's constants less certain: they are constant.
TEST(Smoother, KnowsTheVehicleBetterWithEveryPass) {
  const VgdOptions options = FixedStrengths();
  const Flight flight(Hippodrome(40.0), 4, options);
  const EstimatorRun run = RunSmoother(flight.data, options, SmootherOptions());
  const SimulationConfig truth = Hippodrome(40.0);
  double last = 1.0;
  for (const WindowEstimate& window : run.windows) {
    const double sigma = Find(window, "K_x").sigma;
    EXPECT_LT(sigma, 1.02 * last) << window.tau;  // re-linearised: not to the last digit
    last = sigma;
  }
  EXPECT_NEAR(Find(run.windows.back(), "K_x").value, truth.vehicle.drag.x(), 4.0 * last);
}

// --- False passes (another object detected as the gate): named, and excluded from learning.

testing_simulation::Flown Fly(double duration, int seed) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome", duration);
  config.warm_up = 5.0;
  return testing_simulation::Fly(config, seed);
}

FlightData DataOf(const FlightLog& log) {
  const VgdOptions options;
  return {log, options.drive, options.passes, options.drag_measurement};
}

EstimatorRun Smooth(const FlightLog& log, double probability) {
  SmootherOptions options;
  options.false_pass.probability = probability;
  return RunSmoother(DataOf(log), VgdOptions(), options);
}

int FalseAlarms(const EstimatorRun& run) {
  int count = 0;
  for (const std::string& warning : run.warnings) {
    count += warning.find("looks false") != std::string::npos;
  }
  return count;
}

// All fixes of the given passes (from 0) are of an object displaced from the gate by `d`.
FlightLog WithFalsePasses(FlightLog log, const std::vector<int>& passes, const Eigen::Vector3d& d) {
  const std::vector<Pass> found = FindPasses(log.fixes, PassOptions());
  for (const int k : passes) {
    for (std::size_t i = found[k].first; i <= found[k].last; ++i) log.fixes[i].p_E -= d;
  }
  return log;
}

TEST(FalsePass, SlowIsNamedAndDoesNoHarm) {
  const Eigen::Vector3d d(0.5, 3.0, 0.0);  // m
  const FlightLog clean = Fly(40.0, 1).log;
  const FlightLog spoilt = WithFalsePasses(clean, {2, 5}, d);
  const EstimatorRun sure = Smooth(clean, 0.05), robust = Smooth(spoilt, 0.05),
                     naive = Smooth(spoilt, 0.0);
  EXPECT_THAT(robust.warnings, ElementsAre(HasSubstr("pass 3 "), HasSubstr("pass 6 ")));
  EXPECT_EQ(FalseAlarms(naive), 0);
  const double error = SummariseArcs(robust).error.mean;
  EXPECT_LT(error, 1.5 * SummariseArcs(sure).error.mean);
  EXPECT_LT(error, 0.6 * SummariseArcs(naive).error.mean);
}

TEST(FalsePass, SlowGoodFlightsRaiseNoAlarm) {
  int alarms = 0, passes = 0;
  for (int seed = 11; seed <= 14; ++seed) {
    const EstimatorRun run = Smooth(Fly(30.0, seed).log, 0.05);
    passes += static_cast<int>(run.windows.size());
    alarms += FalseAlarms(run);
  }
  ASSERT_GE(passes, 25);
  EXPECT_LE(alarms, 1);
}

}  // namespace
}  // namespace trueline::testing_vgd
