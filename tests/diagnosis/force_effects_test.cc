// Aerodynamic effects in the preintegrated chain against plain integration at the IMU's rate.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "problems/effects/effect.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/motion_chain.h"
#include "tests/vgd/flown_log.h"

namespace trueline {
namespace {

constexpr double kQuadraticDrag = 0.1, kRotorDrag = 0.02, kStepTime = 1.5, kFactor = 1.4;
const Eigen::Vector3d kWind(2.0, -1.0, 0.0);

// Heun's steps of eq. 15 with the effects written out by themselves.
MotionState<double> Reference(const DriveTrack& track, double K_x, double K_y,
                              MotionState<double> x, TimeNs end) {
  double t = 0.0;
  const auto acceleration = [&](const Drive& drive, const Eigen::Vector3d& v_E, double at) {
    const Eigen::Matrix3d& R = drive.R_Ep_I;  // no misalignment, no AHRS error
    const Eigen::Vector3d air = R.transpose() * (v_E - kWind);
    const double factor = at >= kStepTime ? kFactor : 1.0;
    Eigen::Vector3d f_B(factor * K_x * air.x(), factor * K_y * air.y(), drive.a_z);
    const double drag = kQuadraticDrag * air.norm() - kRotorDrag * drive.a_z;
    f_B.head<2>() -= drag * air.head<2>();
    return Eigen::Vector3d(R * f_B + Eigen::Vector3d(0.0, 0.0, 9.81));
  };
  for (const DriveStep& step : track.steps()) {
    if (step.t >= end) break;
    const Eigen::Vector3d a1 = acceleration(step.drive, x.v, t + 0.5 * step.dt);
    const Eigen::Vector3d a2 = acceleration(step.drive, x.v + a1 * step.dt, t + 0.5 * step.dt);
    x.p += x.v * step.dt + 0.25 * step.dt * step.dt * (a1 + a2);
    x.v += 0.5 * step.dt * (a1 + a2);
    t += step.dt;
  }
  return x;
}

TEST(ForceEffects, TheChainFollowsPlainIntegration) {
  const FlightLog log = testing_window::FlownLog(3.0);
  const DriveTrack track = DriveTrack::FromLog(log, DriveOptions());
  const ForceEffects effects =
      ForceEffectsOf({{"quadratic_drag", {{"c", kQuadraticDrag}}},
                      {"rotor_drag", {{"k", kRotorDrag}}},
                      {"wind", {{"w_x", kWind.x()}, {"w_y", kWind.y()}}},
                      {"drag_step", {{"t_step", kStepTime}, {"factor", kFactor}}}});
  ImuDrivenParameters<double> parameters;
  parameters.K_x = -0.4;
  parameters.K_y = -0.6;
  MotionState<double> start;
  start.v = Eigen::Vector3d(3.0, 1.0, 0.2);
  const TimeNs end = FromSeconds(2.5);
  const MotionChain chain(track, track.begin(), {end});
  MotionState<double> chained, without;
  const ImuDrivenModel<double> model(parameters, 9.81);
  const auto store = [](MotionState<double>* out) {
    return [out](std::size_t, const MotionState<double>& x, const Vector3<double>&) { *out = x; };
  };
  chain.Integrate(model, start, store(&chained), &effects);
  chain.Integrate(model, start, store(&without));
  const MotionState<double> reference = Reference(track, -0.4, -0.6, start, end);
  EXPECT_GT((without.p - reference.p).norm(), 0.5);
  EXPECT_LT((chained.p - reference.p).norm(), 5e-3);
  EXPECT_LT((chained.v - reference.v).norm(), 5e-3);
}

// The model of a flight may hold a step, and a diagnosis tries further ones beside it.
TEST(ForceEffects, StepsOfDragFollowEachOther) {
  const ForceEffects effects = ForceEffectsOf({{"drag_step", {{"t_step", 3.0}, {"factor", 0.5}}},
                                               {"drag_step", {{"t_step", 1.5}, {"factor", 1.4}}}});
  const Eigen::Vector3d forward(2.0, 0.0, 0.0), still = Eigen::Vector3d::Zero();
  const auto added = [&](double t) {
    return effects.AddedForce(-0.4, -0.6, forward, still, 9.81, t).x();
  };
  EXPECT_NEAR(added(1.0), 0.0, 1e-12);
  EXPECT_NEAR(added(2.0), -0.4 * 2.0 * 0.4, 1e-12);
  EXPECT_NEAR(added(4.0), -0.4 * 2.0 * (0.5 * 1.4 - 1.0), 1e-12);
}

// --- The smoothed accelerometer x and y of a diagnosis: effects of turns are kept, vibration of
// rotors is removed.

std::vector<ImuSample> Imu(double rate, double seconds, const std::function<double(double)>& a_x) {
  std::vector<ImuSample> imu;
  imu.reserve(static_cast<std::size_t>(rate * seconds));
  for (int i = 0; i < rate * seconds; ++i) {
    imu.push_back({FromSeconds(i / rate), Eigen::Vector3d(a_x(i / rate), 0.0, -9.8),
                   Eigen::Vector3d::Zero()});
  }
  return imu;
}

double LargestError(const std::vector<ImuSample>& imu, const std::function<double(double)>& truth) {
  double largest = 0.0;
  for (const ForceSample& sample : SmoothForces(imu)) {
    largest = std::max(largest, std::abs(sample.accel_xy.x() - truth(ToSeconds(sample.t))));
  }
  return largest;
}

// Drag in a turn of 3 rad/s; a plain mean over the same span misses its curvature by 2 %.
TEST(SmoothForces, KeepTheCurvatureOfTurns) {
  const auto turn = [](double t) { return 5.0 * std::sin(3.0 * t); };
  EXPECT_LT(LargestError(Imu(512, 10, turn), turn), 0.005);
  EXPECT_LT(LargestError(Imu(60, 10, turn), turn), 0.005);
}

TEST(SmoothForces, LeaveVibrationOut) {
  for (const double hz : {60.0, 97.0, 180.0}) {
    const auto vibration = [hz](double t) { return std::sin(2.0 * M_PI * hz * t); };
    EXPECT_LT(LargestError(Imu(512, 10, vibration), [](double) { return 0.0; }), 0.01) << hz;
  }
}

TEST(SmoothForces, NeedEnoughSamplesForAParabola) {
  EXPECT_TRUE(SmoothForces(Imu(8, 10, [](double) { return 1.0; })).empty());
}

}  // namespace
}  // namespace trueline