// Flights without gates: how they are divided, the noise of their fixes, and what withholding
// withholds.
#include <algorithm>

#include "cost_functions/fix_residual.h"
#include "problems/common/error.h"
#include "problems/vgd/passes.h"
#include "tests/common/bands.h"
#include "tests/common/matchers.h"
#include "tests/vgd/flights.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr double kTau = 60.0;  // s

SimulationConfig Outdoors(double duration) {
  SimulationConfig config = testing_simulation::ReadShipped("gnss", duration);
  return config;
}

FlightData DataOf(const FlightLog& log, const PassOptions& passes = {}) {
  return FlightData(log, DriveOptions(), passes, DragMeasurementOptions());
}

TEST(FixNoise, ChangesAsAGaussMarkovProcess) {
  const FixNoise noise{.white = 0.1, .correlation_time = kTau};
  EXPECT_NEAR(noise.WalkVariance(2.0, 0.06), 2.0 * 4.0 * 0.06 / kTau, 1e-5);
  EXPECT_NEAR(noise.WalkVariance(2.0, 100.0 * kTau), 2.0 * 4.0, 1e-9);
  EXPECT_NEAR(noise.StepVariance(2.0, 0.0), 2.0 * 0.01, 1e-12);
}

// Along a cubic the places at the times of measurement are exact.
TEST(FixStep, ComparesPlacesAtTheTimesOfMeasurement) {
  const Vector3d c0(3, 4, 5), c1(1, -2, 0.5), c2(0.7, 2, -1), c3(-0.4, 0.3, 0.2);
  const auto place = [&](double t) -> Vector3d { return c0 + t * (c1 + t * (c2 + t * c3)); };
  const auto speed = [&](double t) -> Vector3d { return c1 + t * (2.0 * c2 + 3.0 * t * c3); };
  const double seconds = 0.6, tau = 0.1 + 0.05 * 2.0, delay[] = {2.0};
  double node[kGustAt] = {}, next[kGustAt] = {}, r[3];
  Eigen::Map<Eigen::Matrix<double, 6, 1>>(node + kStateAt) << place(0.0), speed(0.0);
  Eigen::Map<Eigen::Matrix<double, 6, 1>>(next + kStateAt) << place(seconds), speed(seconds);
  const Vector3d fix_E(1.0, -2.0, 0.5);
  for (const bool less_first : {true, false}) {
    const FixStepError error{fix_E, 0.2, seconds, less_first, {0.1, 0.05}};
    ASSERT_TRUE(error(node, next, delay, r));
    Vector3d moved = place(seconds - tau);
    if (less_first) moved -= place(-tau);
    EXPECT_LT((Eigen::Map<const Vector3d>(r) - (moved - fix_E) / 0.2).norm(), 1e-9);
  }
}

TEST(ContinuousFixes, AreThoseWithoutGatesAndPauses) {
  const ContinuousFixOptions options;
  FlightLog log = Simulate(Outdoors(30.0), 1);
  const auto found = FindContinuousFixes(log, options);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->rate, 5.0, 1e-6);
  EXPECT_THAT(found->Text(),
              HasSubstr("the fixes are continuous (5 Hz): time divides the flight into arcs of"));

  FlightLog with_gates = log;
  with_gates.gates.push_back({0, Vector3d::Zero(), 0.0});
  EXPECT_FALSE(FindContinuousFixes(with_gates, options).has_value());

  ContinuousFixOptions never = options;
  never.divide = DivideFixes::kNever;
  EXPECT_FALSE(FindContinuousFixes(log, never).has_value());

  std::erase_if(log.fixes, [](const Fix& fix) {
    return ToSeconds(fix.t) - 6.0 * std::floor(ToSeconds(fix.t) / 6.0) > 3.0;
  });
  EXPECT_FALSE(FindContinuousFixes(log, options).has_value());
}

TEST(ContinuousFixes, TheirWhitePartIsMeasured) {
  for (const double white : {0.03, 0.3}) {
    SimulationConfig config = Outdoors(60.0);
    config.gnss.white_sigma = white;
    const auto found = FindContinuousFixes(Simulate(config, 2), {});
    ASSERT_TRUE(found.has_value());
    // The slow part's changes enter third differences with 6 of the white part's 20.
    const double walk = found->noise.WalkVariance(config.gnss.sigma, 1.0 / config.gnss.rate);
    const double expected = std::sqrt(white * white + 0.3 * walk);
    EXPECT_NEAR(found->noise.white, expected, 0.2 * expected);
  }
}

TEST(ContinuousFixes, PreparingALogTwiceIsPreparingItOnce) {
  const FlightLog log = Simulate(Outdoors(40.0), 3);
  const ContinuousFixOptions options;
  const auto once = WithFixesToFit(log, options, *FindContinuousFixes(log, options));
  const auto twice = WithFixesToFit(*once, options, *FindContinuousFixes(*once, options));
  ASSERT_EQ(once->fixes.size(), twice->fixes.size());
  EXPECT_LT(once->fixes.size(), log.fixes.size() / 2);
  for (std::size_t i = 0; i < once->fixes.size(); ++i) {
    EXPECT_EQ(once->fixes[i].t, twice->fixes[i].t);
  }
}

TEST(ContinuousFixes, RestOnTheGroundIsNoFlight) {
  FlightLog log = Simulate(Outdoors(30.0), 3);
  const TimeNs take_off = FromSeconds(12.0);
  for (ImuSample& sample : log.imu) {
    if (sample.t < take_off) sample = {sample.t, {0.0, 0.0, -9.81}, Vector3d::Zero()};
  }
  const auto first = std::find_if(log.fixes.begin(), log.fixes.end(),
                                  [&](const Fix& fix) { return fix.t >= take_off; });
  for (auto fix = log.fixes.begin(); fix != first; ++fix) fix->p_E = first->p_E;
  const ContinuousFixOptions options;
  const auto fit = WithFixesToFit(log, options, *FindContinuousFixes(log, options));
  EXPECT_NEAR(ToSeconds(fit->fixes.front().t), 11.0, 1.7);
}

TEST(Passes, OfAFlightWithoutGatesAreDividedByTime) {
  const FlightLog log = Simulate(Outdoors(60.0), 4);
  const FlightData data = DataOf(log);
  ASSERT_TRUE(data.continuous.has_value());
  ASSERT_GE(data.passes.size(), 9u);
  for (std::size_t k = 0; k + 1 < data.passes.size(); ++k) {
    const double arc = SecondsBetween(data.passes[k].end, data.passes[k + 1].begin);
    EXPECT_GE(arc, data.continuous->arc - 1e-9);
    EXPECT_LT(arc, data.continuous->arc + 0.7);
    EXPECT_TRUE(data.HasArc(static_cast<int>(k) + 1));
    EXPECT_EQ(data.ArcAfter(static_cast<int>(k) + 1).truth_source, "fixes");
  }
}

// The window that predicts an arc must not know of a fix within or after it. (The white part of the
// noise comes from all fixes, and changes a little.)
TEST(Passes, WithheldFixesDoNotEnterThePrediction) {
  const VgdOptions options;
  FlightLog log = Simulate(Outdoors(40.0), 5);
  const int tau = 3;
  const FlightData before = DataOf(log);
  const WindowEstimate honest = SolveWindow(before, options, tau, PriorMeans(options));
  const TimeNs end = before.passes[tau - 1].end;
  for (Fix& fix : log.fixes) {
    if (fix.t > end) fix.p_E += Vector3d(50.0, -20.0, 5.0);
  }
  const FlightData after = DataOf(log);
  const WindowEstimate blind = SolveWindow(after, options, tau, PriorMeans(options));
  EXPECT_LT((honest.arc->p_E - blind.arc->p_E).norm(), 0.05);
  EXPECT_LT((honest.arc->cov - blind.arc->cov).norm(), 0.05 * honest.arc->cov.norm());
  EXPECT_NEAR((*blind.arc->truth - *honest.arc->truth).x(), 50.0, 1e-9);
  for (std::size_t i = 0; i < honest.parameters.size(); ++i) {
    EXPECT_NEAR(honest.parameters[i].value, blind.parameters[i].value,
                0.1 * honest.parameters[i].sigma);
  }
}

TEST(Passes, ALogOfMocapAloneIsFittedToMocap) {
  SimulationConfig config = Outdoors(30.0);
  config.sensors["mocap"]["rate"] = 50.0;
  FlightLog log = Simulate(config, 6);
  log.fixes.clear();
  const FlightData data = DataOf(log);
  ASSERT_TRUE(data.continuous && data.continuous->from_mocap);
  EXPECT_FALSE(data.continuous->noise.IsCorrelated());
  ASSERT_GE(data.passes.size(), 4u);
  EXPECT_EQ(data.ArcAfter(1).truth_source, "mocap");
  EXPECT_NEAR(SecondsBetween(data.log.fixes[0].t, data.log.fixes[1].t), 0.1, 1e-6);
}

// An accelerometer tilted on its board by 3 deg shows a share of the drag along its z axis; on a
// course that is always flown forwards the published model puts it into b_az.
TEST(Passes, DragAlongATiltedAxisIsNoBias) {
  SimulationConfig config = Outdoors(60.0);
  config.imu.misalignment = {0.0, 0.05, 0.0};
  const auto error = [&](ThrustSource thrust) {
    VgdOptions options;
    options.drive.thrust = thrust;
    const testing_vgd::Flight flight(config, 7, options);
    const WindowEstimate last = RunVgd(flight.data, options).windows.back();
    const ParameterEstimate& bias = testing_vgd::Find(last, "b_az");
    return std::pair(bias.value - config.imu.accel_bias.z(), bias.sigma);
  };
  const auto [off, sigma] = error(ThrustSource::kAccelerometer);
  EXPECT_LT(std::abs(off), 2.0 * sigma);
  EXPECT_LT(std::abs(off), 0.04);
  EXPECT_GT(std::abs(error(ThrustSource::kAsPublished).first),
            0.04);  // 0.35 1/s * 5 m/s * 0.05 rad
}

// Statistics over all arcs and parameters of one flight; config/README.md has coverage by seeds.
TEST(Passes, AFlightWithoutGatesCalibrates) {
  const VgdOptions options;
  SimulationConfig config = Outdoors(90.0);
  const testing_vgd::Flight flight(config, 7, options);
  const EstimatorRun run = RunVgd(flight.data, options);
  const ArcCount arcs = CountArcs(run);
  EXPECT_GE(arcs.count, 12);
  EXPECT_GE(arcs.inside, 0.75 * arcs.count);
  const WindowEstimate& last = run.windows.back();
  const ParameterEstimate& drag = testing_vgd::Find(last, "K_x");
  EXPECT_LT(std::abs(drag.value - config.vehicle.drag.x()), 4.0 * drag.sigma);
  EXPECT_LT(drag.sigma, 0.1);
  ASSERT_TRUE(last.fix_latency.has_value());
  EXPECT_LT(std::abs(last.fix_latency->value - config.gnss.latency), 3.0 * last.fix_latency->sigma);
  EXPECT_LT(last.fix_latency->sigma, 0.1);
}

}  // namespace
}  // namespace trueline
