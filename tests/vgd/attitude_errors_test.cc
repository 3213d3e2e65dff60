// What the attitude filter did to the logged attitude, from the log's own gyroscope and
// accelerometer, against mocap that the estimator does not see.
#include "problems/vgd/attitude_errors.h"

#include <gtest/gtest.h>

#include "problems/common/random.h"
#include "problems/common/units.h"
#include "problems/effects/effect.h"
#include "problems/log/samples.h"
#include "problems/vgd/rough_path.h"
#include "tests/simulation/short_flight.h"
#include "tests/vgd/tilt_noise.h"

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kGain = 0.05;  // 1/s
const Vector3d kBias(0.006, -0.004, 0.005);

FlightLog Filtered(const std::vector<Effect>& effects = {}) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 50.0);
  config.imu.gyro_bias = kBias;
  config.imu.misalignment.setZero();  // mocap's attitude is the body's
  config.ahrs.tilt_gain = kGain;
  config.effects = effects;
  return testing_simulation::Fly(config, 3).log;
}

AttitudeErrors ErrorsOf(const FlightLog& log) { return {log, log.attitude, {}}; }

// Rms of the tilt error about its mean over a quarter of the flight, rad, against mocap.
double TiltError(const FlightLog& log, const AttitudeErrors& errors) {
  AttitudeCursor cursor(log.attitude);
  std::vector<Eigen::Vector2d> tilt;
  for (const PoseSample& truth : log.mocap) {
    Quaterniond q;
    if (!cursor.At(truth.t, 0.1, &q)) continue;
    const Quaterniond rest = errors.Corrected(truth.t, q) * truth.q_E.conjugate();
    tilt.emplace_back(2.0 * std::copysign(1.0, rest.w()) * rest.vec().head<2>());
  }
  double sum = 0.0;
  const std::size_t quarter = tilt.size() / 4;
  for (int part = 0; part < 4; ++part) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    const auto begin = tilt.begin() + static_cast<std::ptrdiff_t>(part * quarter);
    for (auto at = begin; at != begin + static_cast<std::ptrdiff_t>(quarter); ++at) mean += *at;
    mean /= static_cast<double>(quarter);
    for (auto at = begin; at != begin + static_cast<std::ptrdiff_t>(quarter); ++at) {
      sum += (*at - mean).squaredNorm() / static_cast<double>(4 * quarter);
    }
  }
  return std::sqrt(sum);
}

TEST(AttitudeErrors, FindTheFiltersGainAndTheGyroscopesBias) {
  const AttitudeErrors errors = ErrorsOf(Filtered());
  EXPECT_NEAR(errors.fit().k_p, kGain, 0.2 * kGain);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(errors.fit().gyro_bias[axis], kBias[axis], 1e-3);
  }
  EXPECT_DOUBLE_EQ(errors.hold(), AttitudeErrorOptions().longest_hold);
}

TEST(AttitudeErrors, TheGyroscopeTakesOutTheFiltersFeedback) {
  const FlightLog log = Filtered();
  AttitudeErrorOptions as_logged;
  as_logged.longest_hold = 0.0;
  const double logged = TiltError(log, {log, log.attitude, as_logged});
  const double held = TiltError(log, ErrorsOf(log));
  EXPECT_GT(logged, 0.25 * kDegree);
  EXPECT_LT(held, 0.6 * logged);  // mocap's own error of 0.15 deg included
}

TEST(AttitudeErrors, APoorGyroscopeReplacesNothing) {
  FlightLog log = Filtered();
  Random random(1, "gyro");
  constexpr double kDensity = 0.02;  // rad/s/sqrt(Hz)
  const double sigma = kDensity * std::sqrt(512.0);
  for (ImuSample& sample : log.imu) sample.gyro += sigma * random.NormalVector3();
  const AttitudeErrors errors = ErrorsOf(log);
  EXPECT_NEAR(errors.fit().scatter, kDensity, 0.3 * kDensity);
  EXPECT_EQ(errors.hold(), 0.0);
  const Quaterniond& q = log.attitude[5000].q_Ep_I;
  EXPECT_EQ(errors.Corrected(log.attitude[5000].t, q).coeffs(), q.coeffs());
}

TEST(AttitudeErrors, TheShareOfTheTiltIsAnErrorOfTheFramesAngles) {
  FlightLog log = Filtered();
  AttitudeErrorOptions as_logged;
  as_logged.longest_hold = 0.0;
  as_logged.priors.share = 0.05;
  const AttitudeErrors errors(log, log.attitude, as_logged);
  const int share = kFilterSize - 1;
  constexpr double kSigma = 0.05;  // of the tilt
  // Where the vehicle tilts most, one sigma of the error changes the tilt by a twentieth; a mean
  // over the flight is the frame's constant error.
  double largest = 0.0;
  std::vector<Vector3d> rest;
  for (std::size_t i = 200; i + 200 < log.attitude.size(); i += 50) {
    const TimeNs t = log.attitude[i].t;
    const Vector3d Phi = errors.MeanOver(t - kNsPerSecond / 20, t + kNsPerSecond / 20).col(share);
    const Quaterniond& q = log.attitude[i].q_Ep_I;
    const Quaterniond turned = QuaternionFromEuler<double>(Phi) * q;  // q_E_I for one sigma
    const Vector3d down = turned * Vector3d::UnitZ(), before = q * Vector3d::UnitZ();
    largest = std::max(largest, before.head<2>().norm());
    rest.push_back(down - (1.0 - kSigma) * before);
  }
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& r : rest) mean += r / static_cast<double>(rest.size());
  ASSERT_GT(largest, 0.2);
  for (const Vector3d& r : rest) EXPECT_LT((r - mean).head<2>().norm(), 0.4 * kSigma * largest);
}

// --- The logged attitude without noise that the gyroscope contradicts, against the same log
// without it.

constexpr double kTiltSigma = 0.015;  // rad
constexpr double kTiltMemory = 1.0;   // s

const FlightLog& Flown() {
  static const FlightLog log = testing_simulation::LogOf("hippodrome", 100.0, 3);
  return log;
}

// rad, rms of the angle between two streams.
double Apart(const std::vector<AttitudeSample>& a, const std::vector<AttitudeSample>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += RotationVector(a[i].q_Ep_I * b[i].q_Ep_I.conjugate()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(FastPart, AConstantRateLeavesNothingAndAStepAllOfItself) {
  const std::vector<double> seconds(400, 0.1);
  std::vector<Vector3d> changes(400, Vector3d(0.01, 0.0, 0.0));
  const std::vector<Vector3d> drift = FastPart(changes, seconds, 2.0);
  EXPECT_NEAR(drift[200].x(), 0.0, 1e-4);
  changes.assign(400, Vector3d::Zero());
  changes[199].y() = 1.0;
  const std::vector<Vector3d> step = FastPart(changes, seconds, 2.0);
  EXPECT_NEAR(step[200].y() - step[199].y(), 1.0, 0.05);
  EXPECT_NEAR(step[250].y(), 0.5 * std::exp(-5.0 / 2.0), 0.01);
}

TEST(SmoothAttitude, AGoodGyroscopeTakesMostOfTheNoiseOut) {
  const FlightLog log = Flown();
  std::vector<AttitudeSample> noisy = log.attitude;
  AddTiltNoise(kTiltSigma, kTiltMemory, &noisy);
  const double noise = Apart(noisy, log.attitude);
  EXPECT_NEAR(noise, std::sqrt(2.0) * kTiltSigma, 0.4 * kTiltSigma);
  const auto clean = SmoothAttitude(log.imu, log.attitude), smooth = SmoothAttitude(log.imu, noisy);
  EXPECT_LT(Apart(smooth, clean), 0.5 * noise);
  EXPECT_LT(Apart(smooth, log.attitude), 0.6 * noise);
}

TEST(SmoothAttitude, APoorGyroscopeOrNoneChangesNothing) {
  FlightLog log = Flown();
  EXPECT_LT(Apart(SmoothAttitude({}, log.attitude), log.attitude), 1e-15);
  Random random(1, "gyro");
  for (ImuSample& sample : log.imu) sample.gyro += 10.0 * random.NormalVector3();
  EXPECT_LT(Apart(SmoothAttitude(log.imu, log.attitude), log.attitude), 0.02);
}

// The slope by the scale is the true tilt, so that noise of the attitude is not taken for a scale.
TEST(SmoothAttitude, TheSlopeByTheScaleIsTheTrueTilt) {
  FlightLog log = Flown();
  const auto slope = [](FlightLog at) {
    constexpr double kStep = 0.01;
    const FlightLog moved = CorrectLog(at, {{"tilt_scale", {{"s", kStep}}}}, {});
    std::vector<Vector3d> slopes;
    for (std::size_t i = 0; i < at.attitude.size(); i += 50) {
      const auto turned = moved.attitude[i].q_Ep_I * at.attitude[i].q_Ep_I.conjugate();
      slopes.push_back(RotationVector(turned) / kStep);
    }
    return slopes;
  };
  const std::vector<Vector3d> exact = slope(log);
  std::vector<AttitudeSample> quiet = log.attitude;
  AddTiltNoise(kTiltSigma, kTiltMemory, &log.attitude);
  const std::vector<Vector3d> noisy = slope(log);
  double apart = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) apart += (noisy[i] - exact[i]).squaredNorm();
  const double rms = std::sqrt(apart / static_cast<double>(exact.size()));
  EXPECT_LT(rms, 0.6 * Apart(log.attitude, quiet));
}

}  // namespace
}  // namespace trueline
