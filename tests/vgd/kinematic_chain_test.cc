// Preintegrated blocks against stepping the model through every IMU sample.
#include "problems/vgd/kinematic_chain.h"

#include <gtest/gtest.h>

#include "problems/vgd/flight_data.h"

namespace trueline {
namespace {

constexpr double kGravity = 9.81;

// 10 s of brisk turning at an uneven 500 Hz.
FlightLog TurningLog() {
  FlightLog log;
  log.gravity = kGravity;
  for (int k = 0; k <= 5000; ++k) {
    const double t = 0.002 * k + 0.0003 * std::sin(0.37 * k);
    log.imu.push_back({FromSeconds(t),
                       {1.5 * std::sin(1.7 * t), std::cos(2.3 * t), -9.0 + std::sin(0.9 * t)},
                       {2.0 * std::sin(3.1 * t), 1.5 * std::cos(2.7 * t), 1.2}});
    log.attitude.push_back({FromSeconds(t), Eigen::Quaterniond::Identity()});
  }
  return log;
}

KinematicState<double> StepThrough(const ImuInputs& imu, TimeNs from, TimeNs to,
                                   const ImuBias<double>& bias, KinematicState<double> x) {
  imu.ForEachStep(from, to, [&](const ImuInput& input, double dt) {
    KinematicStep(input, bias, kGravity, dt, &x);
    x.q_E_I.normalize();
  });
  return x;
}

class ChainTest : public testing::Test {
 protected:
  const FlightLog log_ = TurningLog();
  const DriveTrack track_ = DriveTrack::FromLog(log_, DriveOptions());
  const ImuInputs imu_{log_, track_};
  const TimeNs from_ = FromSeconds(0.0513), to_ = FromSeconds(9.5117);
};

TEST_F(ChainTest, BlocksOfThirtyMillisecondsFollowEverySampleForTenSeconds) {
  const KinematicChain chain(imu_, from_, {FromSeconds(4.0), to_}, 0.03);
  // Biases at the size of Table 2's ranges; the last at the filter's hard bounds.
  const struct {
    ImuBias<double> bias;
    double p_error;
  } cases[] = {{{}, 1e-4},
               {{{0.1, -0.1, 0.1}, {0.004, -0.003, 0.002}}, 0.001},
               {{{1.0, -1.0, 1.0}, {0.05, -0.05, 0.05}}, 0.1}};
  for (const auto& test : cases) {
    KinematicState<double> start;
    start.v = {2.0, 1.0, 0.0};
    const KinematicState<double> expected = StepThrough(imu_, from_, to_, test.bias, start);
    KinematicState<double> end;
    chain.Integrate(test.bias, start,
                    [&](std::size_t, const KinematicState<double>& x) { end = x; });
    EXPECT_LT((end.p - expected.p).norm(), test.p_error);
    EXPECT_LT(end.q_E_I.angularDistance(expected.q_E_I), 1e-4 + test.bias.gyro.norm() * 1e-3);
  }
}

// At rest and level, gravity and specific force cancel; nothing moves.
TEST_F(ChainTest, RestStaysAtRest) {
  FlightLog rest = log_;
  for (ImuSample& sample : rest.imu) {
    sample.accel = {0.0, 0.0, -kGravity};
    sample.gyro.setZero();
  }
  const DriveTrack track = DriveTrack::FromLog(rest, DriveOptions());
  const KinematicChain chain(ImuInputs(rest, track), from_, {to_}, 0.03);
  chain.Integrate(ImuBias<double>(), KinematicState<double>(),
                  [](std::size_t, const KinematicState<double>& x) {
                    EXPECT_LT(x.p.norm(), 1e-9);
                    EXPECT_LT(x.v.norm(), 1e-9);
                  });
}

// Independent of quaternions and midpoints: a constant rate w about z with a constant force f in I
// gives v = g t + f/w (sin wt, 1 - cos wt) in closed form.
TEST(KinematicStepTest, CircleInClosedForm) {
  const double w = 1.3, f = 2.0, dt = 0.001, t = 2.0;
  const ImuInput input{{f, 0.0, -kGravity}, {0.0, 0.0, w}};
  KinematicState<double> x;
  EulerKinematicState<double> euler;
  for (int k = 0; k < 2000; ++k) {
    KinematicStep(input, ImuBias<double>(), kGravity, dt, &x);
    KinematicStep(input, ImuBias<double>(), kGravity, dt, &euler);
  }
  const Eigen::Vector3d v(f / w * std::sin(w * t), f / w * (1.0 - std::cos(w * t)), 0.0);
  const Eigen::Vector3d p(f / (w * w) * (1.0 - std::cos(w * t)), f / w * (t - std::sin(w * t) / w),
                          0.0);
  EXPECT_LT((x.v - v).norm(), 1e-6);
  EXPECT_LT((x.p - p).norm(), 1e-6);
  EXPECT_LT((euler.v - v).norm(), 1e-6);
  EXPECT_LT((euler.p - p).norm(), 1e-6);
  EXPECT_NEAR(euler.Phi.z(), w * t, 1e-9);
}

}  // namespace
}  // namespace trueline
