// Noise measured from the log, and the other sensors' settings.
#include <cmath>

#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_simulation {
namespace {

using Eigen::Vector3d;

SimulationConfig Hover(double duration) { return ReadShipped("hover", duration); }

TEST(Sensors, NoiseDensitiesAreThoseStated) {
  const SimulationConfig config = Hover(30.0);
  const FlightLog log = Simulate(config, 3);
  double accel = 0.0, gyro = 0.0;
  for (const ImuSample& sample : log.imu) {
    accel += (sample.accel - Vector3d(0, 0, -9.81)).squaredNorm() / 3.0;
    gyro += sample.gyro.squaredNorm() / 3.0;
  }
  const auto count = static_cast<double>(log.imu.size());
  EXPECT_NEAR(std::sqrt(accel / count / 512.0), config.imu.accel_noise_density, 2e-5);
  EXPECT_NEAR(std::sqrt(gyro / count / 512.0), config.imu.gyro_noise_density, 2e-6);
}

TEST(Sensors, BiasesAddToTheReading) {
  SimulationConfig config = Hover(1.0);
  config.imu.accel_noise_density = config.imu.gyro_noise_density = 0.0;
  config.imu.accel_bias = {0.1, -0.2, 0.3};
  config.imu.gyro_bias = {0.01, 0.02, -0.03};
  const FlightLog log = Simulate(config, 1);
  EXPECT_LT((log.imu[9].accel - Vector3d(0.1, -0.2, -9.51)).norm(), 1e-6);
  EXPECT_LT((log.imu[9].gyro - config.imu.gyro_bias).norm(), 1e-6);
}

// For a bias with a random walk the truth file states its mean over the log, which a fit estimates.
TEST(Sensors, TruthOfAWalkingBiasIsItsMean) {
  SimulationConfig config = Hover(4.0);
  config.imu.accel_noise_density = config.imu.gyro_noise_density = 0.0;
  config.imu.accel_bias_walk = 0.2;
  SimulationTruth truth;
  const FlightLog log = Simulate(config, 1, &truth);
  Vector3d mean = Vector3d::Zero();
  for (const ImuSample& sample : log.imu) {
    mean += (sample.accel - Vector3d(0, 0, -9.81)) / static_cast<double>(log.imu.size());
  }
  EXPECT_GT(truth.accel_walk_mean.norm(), 0.01);
  EXPECT_LT((config.imu.accel_bias + truth.accel_walk_mean - mean).norm(), 1e-3);
}

TEST(Sensors, MisalignedImuSeesGravityLean) {
  SimulationConfig config = Hover(1.0);
  config.imu.accel_noise_density = 0.0;
  config.imu.misalignment = {0.02, -0.03, 0.0};  // of B against I
  const Vector3d reading = Simulate(config, 1).imu[0].accel;
  // B level; B is I rolled by +phi, so I is rolled left by phi: its y axis points up a little.
  EXPECT_NEAR(reading.y(), 9.81 * std::sin(0.02), 1e-2);
  EXPECT_NEAR(reading.x(), 9.81 * std::sin(0.03), 1e-2);
}

TEST(Sensors, SaturationAndQuantisation) {
  SimulationConfig config = Hover(1.0);
  config.imu.accel_range = 9.0;
  config.imu.gyro_step = 0.001;
  for (const ImuSample& sample : Simulate(config, 1).imu) {
    EXPECT_EQ(sample.accel.z(), -9.0);
    EXPECT_NEAR(std::remainder(sample.gyro.x(), 0.001), 0.0, 1e-12);
  }
}

TEST(Sensors, VibrationFoldsDownAtTheImuRate) {
  SimulationConfig config = Hover(4.0);
  config.imu.accel_noise_density = 0.0;
  config.imu.vibration.accel = {0.0, 0.0, 1.0};  // third harmonic of 800 rad/s: 382 Hz
  const FlightLog log = Simulate(config, 1);
  const auto power_at = [&](double hertz) {
    double re = 0.0, im = 0.0;
    for (const ImuSample& sample : log.imu) {
      const double phase = 2.0 * M_PI * hertz * ToSeconds(sample.t);
      re += sample.accel.x() * std::cos(phase);
      im += sample.accel.x() * std::sin(phase);
    }
    return std::hypot(re, im) / static_cast<double>(log.imu.size());
  };
  const double alias = 512.0 - 3.0 * 800.0 / (2.0 * M_PI);
  EXPECT_GT(power_at(alias), 20.0 * power_at(alias + 20.0));
}

TEST(Sensors, FixNoiseFollowsDistance) {
  const Flown flown = Fly(ReadShipped("hippodrome_exact"), 5);
  double squares = 0.0;
  for (const Fix& fix : flown.log.fixes) {
    const auto index = static_cast<std::size_t>(std::lround(ToSeconds(fix.t) * 512.0));
    const simulation::TruthSample& truth = flown.truth.trajectory.at(index);
    const Gate& gate = flown.log.gates.at(fix.gate);
    EXPECT_NEAR(fix.sigma, std::max(0.02, 0.1 * (gate.position - truth.p_E).norm()), 1e-3);
    squares += (fix.p_E - truth.p_E).squaredNorm() / (3.0 * fix.sigma * fix.sigma);
  }
  const auto count = static_cast<double>(flown.log.fixes.size());
  EXPECT_NEAR(squares / count, 1.0, 5.0 * std::sqrt(2.0 / (3.0 * count)));
  EXPECT_GT(count / flown.truth.passes, 14.0);
  EXPECT_LT(count / flown.truth.passes, 20.0);
}

TEST(Sensors, OutliersHaveTheirShare) {
  SimulationConfig config = ReadShipped("hippodrome_exact", 60.0);
  config.detector.outlier_share = 0.2;
  config.detector.outlier_size = 50.0;
  const Flown flown = Fly(config, 2);
  int far = 0;
  for (const Fix& fix : flown.log.fixes) far += std::abs(fix.p_E.z() + 1.5) > 2.0 ? 1 : 0;
  const auto count = static_cast<double>(flown.log.fixes.size());
  const double expected = 0.2 * 48.0 / 50.0;
  EXPECT_NEAR(far / count, expected, 4.0 * std::sqrt(expected * (1.0 - expected) / count));
}

TEST(Sensors, ComplementaryFilterErrsByItsGainTimesVelocity) {
  SimulationConfig config = ReadShipped("hippodrome_exact");
  config.ahrs = simulation::AhrsConfig();
  config.ahrs.integral_gain = 0.0;
  config.imu.accel_bias.setZero();
  config.warm_up = 60.0;
  config.duration = 30.0;
  const Flown flown = Fly(config);
  // theta of E' against E is about -k (v_x - mean v_x) / g.
  const double k = config.ahrs.tilt_gain;
  EXPECT_NEAR(flown.truth.ahrs_error_sigma.y(), k * 1.8 / std::sqrt(2.0) / 9.81, 0.002);
  EXPECT_GT(flown.truth.tilt_error_rms, 0.004);
}

TEST(Noise, OrnsteinUhlenbeckHasItsSizeAndMemory) {
  OrnsteinUhlenbeck process(Vector3d(0.5, 0.5, 0.5), 0.8, 1, "test");
  double variance = 0.0, product = 0.0;
  double before = process.value().x();
  constexpr int kSteps = 200000;
  for (int i = 0; i < kSteps; ++i) {
    process.Advance(0.4);
    variance += process.value().x() * process.value().x() / kSteps;
    product += before * process.value().x() / kSteps;
    before = process.value().x();
  }
  EXPECT_NEAR(std::sqrt(variance), 0.5, 0.01);
  EXPECT_NEAR(product / variance, std::exp(-0.5), 0.01);
}

// Over a long hover: scatter, correlation over ten seconds, and the delay on the move.
TEST(Sensors, GnssFixesHaveTheNoiseStated) {
  SimulationConfig config = Hover(600.0);
  config.imu.rate = 64.0;
  config.gnss = {.rate = 2.0, .sigma = 0.5, .correlation_time = 20.0, .white_sigma = 0.1};
  const Flown flown = Fly(config, 8);
  EXPECT_TRUE(flown.log.gates.empty());
  ASSERT_NEAR(static_cast<double>(flown.log.fixes.size()), 1200.0, 1.0);
  const auto error = [&](std::size_t i) {
    const double at = ToSeconds(flown.log.fixes[i].t) * config.imu.rate;
    const auto k = std::min(static_cast<std::size_t>(at), flown.truth.trajectory.size() - 1);
    return Vector3d(flown.log.fixes[i].p_E - flown.truth.trajectory[k].p_E);
  };
  double squares = 0.0, product = 0.0;
  for (std::size_t i = 20; i < flown.log.fixes.size(); ++i) {
    squares += error(i).squaredNorm() / 3.0 / 1180.0;
    product += error(i).dot(error(i - 20)) / 3.0 / 1180.0;
  }
  EXPECT_NEAR(std::sqrt(squares), std::hypot(0.5, 0.1), 0.12);
  EXPECT_NEAR(product / squares, std::exp(-10.0 / 20.0), 0.2);
}

// Over a hover: jumps stay, outliers do not, and the wave has its amplitude.
TEST(Sensors, GnssFixesStray) {
  const auto scatter = [](const simulation::GnssConfig& gnss) {
    SimulationConfig config = Hover(300.0);
    config.imu.rate = 64.0;
    config.gnss = gnss;
    const Flown flown = Fly(config, 8);
    double change = 0.0, squares = 0.0;
    Vector3d mean = Vector3d::Zero();
    const std::vector<Fix>& fixes = flown.log.fixes;
    const auto count = static_cast<double>(fixes.size());
    for (const Fix& fix : fixes) mean += fix.p_E / count;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      squares += (fixes[i].p_E - mean).squaredNorm() / 3.0 / count;
      if (i > 0) change += (fixes[i].p_E - fixes[i - 1].p_E).squaredNorm() / 3.0 / count;
    }
    return std::pair(std::sqrt(squares), std::sqrt(change));
  };
  const simulation::GnssConfig exact{.rate = 2.0, .sigma = 0.0, .white_sigma = 0.0};
  const auto [quiet, steps] = scatter(exact);
  EXPECT_LT(quiet, 0.1);
  simulation::GnssConfig gnss = exact;
  gnss.wave = 0.5;
  EXPECT_NEAR(scatter(gnss).first, 0.5 / std::sqrt(2.0), 0.1);
  gnss = exact;
  gnss.jump = 1.0;
  const auto [far, moved] = scatter(gnss);
  EXPECT_GT(far, 3.0 * moved);  // 15 jumps in 600 fixes add up
  gnss = exact;
  gnss.outlier_share = 0.1;
  const auto [wide, often] = scatter(gnss);
  EXPECT_NEAR(wide, 3.0 * std::sqrt(0.1), 0.35);
  EXPECT_NEAR(often, wide * std::sqrt(2.0), 0.3);
}

TEST(Sensors, GnssFixesAreLateByTheLatency) {
  SimulationConfig config = ShortExactFlight();
  config.gnss = {.rate = 5.0, .sigma = 0.0, .white_sigma = 0.0, .latency = 0.2};
  const Flown flown = Fly(config);
  const Fix& fix = flown.log.fixes[25];
  const double then = (ToSeconds(fix.t) - 0.2) * config.imu.rate;
  const Vector3d p_E = flown.truth.trajectory[static_cast<std::size_t>(std::lround(then))].p_E;
  EXPECT_LT((fix.p_E - p_E).norm(), 0.01);
}

}  // namespace
}  // namespace trueline::testing_simulation
