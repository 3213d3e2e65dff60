// The logged attitude without noise that the gyroscope contradicts, against the same log without
// it.
#include "problems/vgd/smooth_attitude.h"

#include <gtest/gtest.h>

#include "problems/effects/effect.h"
#include "tests/simulation/short_flight.h"
#include "tests/vgd/tilt_noise.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr double kTiltSigma = 0.015;  // rad
constexpr double kTiltMemory = 1.0;   // s

FlightLog Flown() { return testing_simulation::LogOf("hippodrome", 100.0, 3); }

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
