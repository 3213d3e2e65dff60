// CorrectLog removes the effects that the simulator (with its own physics) adds to a log.
#include <gtest/gtest.h>

#include "problems/effects/effect.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_simulation {
namespace {

double LargestTurn(const FlightLog& a, const FlightLog& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.attitude.size(); ++i) {
    const double angle = a.attitude[i].q_Ep_I.angularDistance(b.attitude[i].q_Ep_I);
    largest = std::max(largest, angle);
  }
  return largest;
}

// Largest distance of a fix from where the vehicle was at its time; the exact flight has no noise.
double LargestFixError(const FlightLog& log, const std::vector<simulation::TruthSample>& truth) {
  double largest = 0.0;
  for (const Fix& fix : log.fixes) {
    const double t = SecondsBetween(log.imu.front().t, fix.t);
    const auto after = std::lower_bound(
        truth.begin(), truth.end(), t,
        [](const simulation::TruthSample& s, double value) { return s.t < value; });
    if (after == truth.begin() || after == truth.end()) continue;
    const auto before = after - 1;
    const double share = (t - before->t) / (after->t - before->t);
    const Eigen::Vector3d p_E = before->p_E + share * (after->p_E - before->p_E);
    largest = std::max(largest, (fix.p_E - p_E).norm());
  }
  return largest;
}

struct Case {
  Effect effect;
  double left;  // residual share of the effect's size, at most
};

TEST(CorrectLog, TakesOutWhatTurnsTheAttitude) {
  const FlightLog clean = Fly(ShortExactFlight()).log;
  const std::vector<Case> cases = {
      {{"heading_drift", {{"d", 0.01}}}, 0.02},
      {{"heading_distortion", {{"a_sin", 0.1}, {"a_cos", -0.05}}}, 0.15},
      {{"attitude_latency", {{"tau", 0.05}}}, 1.0},
  };
  for (const Case& c : cases) {
    const FlightLog with = FlyWith(c.effect.id, c.effect.values).log;
    const FlightLog corrected = CorrectLog(with, {c.effect});
    const double before = LargestTurn(with, clean);
    EXPECT_GT(before, 0.01) << c.effect.id;
    if (c.effect.id == "attitude_latency") {
      EXPECT_EQ(with.attitude[9].t - corrected.attitude[9].t, FromSeconds(0.05));
    } else {
      EXPECT_LT(LargestTurn(corrected, clean), c.left * before) << c.effect.id;
    }
  }
}

// Whatever the rate of the attitude, and over its gaps: the tilt settles at that of the drag.
TEST(CorrectLog, TakesOutTheTiltThatDragLooksLike) {
  constexpr double kDrag = 0.4, kSpeed = 3.0;
  for (const double step : {0.002, 0.3, 1.0}) {
    FlightLog log;
    log.imu.push_back({0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    for (double t = 0.0; t<60.0; t += t> 20.0 && t < 21.0 ? 20.0 : step) {
      log.attitude.push_back({FromSeconds(t), Eigen::Quaterniond::Identity()});
    }
    const Eigen::Vector3d v_E(kSpeed, 0.0, 0.0);
    const FlightLog corrected = CorrectLog(log, {{"ahrs_drag_error", {{"k", kDrag}}}},
                                           {{FromSeconds(-1.0), v_E}, {FromSeconds(99.0), v_E}});
    const double expected = kDrag * kSpeed / log.gravity;
    EXPECT_LT(LargestTurn(corrected, log), 1.1 * expected) << step;
    const Eigen::Vector3d z = corrected.attitude.back().q_Ep_I * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR(std::atan2(z.x(), z.z()), -expected, 1e-3) << step;
  }
}

// Roll and pitch alone are the tilt; the heading stays.
TEST(CorrectLog, DividesTheTiltByItsScale) {
  FlightLog log;
  log.imu.push_back({0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
  const auto turned = [](double angle, const Eigen::Vector3d& axis_E) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis_E) *
                              Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ()));
  };
  const Eigen::Vector3d axis_E = Eigen::Vector3d(0.6, -0.8, 0.0);
  log.attitude = {{0, turned(0.55, axis_E)}, {1, turned(0.0, axis_E)}};
  const FlightLog corrected = CorrectLog(log, {{"tilt_scale", {{"s", 0.1}}}});
  EXPECT_LT(corrected.attitude[0].q_Ep_I.angularDistance(turned(0.5, axis_E)), 1e-9);
  EXPECT_LT(corrected.attitude[1].q_Ep_I.angularDistance(turned(0.0, axis_E)), 1e-9);
}

TEST(CorrectLog, TakesTheOtherAxesOutOfTheThrustAxis) {
  FlightLog log;
  log.imu.push_back({0, Eigen::Vector3d(2.0, -1.0, -9.5), Eigen::Vector3d::Zero()});
  const FlightLog corrected =
      CorrectLog(log, {{"accel_cross_axis", {{"l_x", 0.02}, {"l_y", 0.01}}}});
  EXPECT_NEAR(corrected.imu[0].accel.z(), -9.5 - 0.04 + 0.01, 1e-12);
}

TEST(CorrectLog, TakesOutWhatMovesFixes) {
  const std::vector<Case> cases = {
      {{"fix_scale", {{"s", 0.1}}}, 1e-3},
      {{"fix_latency", {{"tau", 0.1}}}, 0.01},
      {{"gate_moved", {{"gate", 1}, {"dx", 0.3}, {"dy", -0.2}, {"dz", 0.1}}}, 1e-3},
      {{"camera_misalignment", {{"roll", 0.02}, {"pitch", 0.1}, {"yaw", -0.1}}}, 0.1},
  };
  for (const Case& c : cases) {
    const auto flown = FlyWith(c.effect.id, c.effect.values);
    const double before = LargestFixError(flown.log, flown.truth.trajectory);
    const double after = LargestFixError(CorrectLog(flown.log, {c.effect}), flown.truth.trajectory);
    EXPECT_GT(before, 0.05) << c.effect.id;
    EXPECT_LT(after, c.left * before + 1e-4) << c.effect.id;
  }
}

TEST(CorrectLog, TakesOutWhatTheAccelerometerAdds) {
  const FlightLog clean = Fly(ShortExactFlight()).log;
  const std::vector<Effect> effects = {
      {"accel_bias_drift", {{"d", 0.02}}},
      {"imu_lever_arm", {{"r_x", 0.1}, {"r_y", -0.05}, {"r_z", 0.03}}},
      {"accel_scale_z", {{"s", 0.1}}}};
  for (const Effect& effect : effects) {
    const FlightLog with = FlyWith(effect.id, effect.values).log;
    const FlightLog corrected = CorrectLog(with, {effect});
    double before = 0.0, after = 0.0;
    for (std::size_t i = 0; i < clean.imu.size(); ++i) {
      before += (with.imu[i].accel - clean.imu[i].accel).squaredNorm();
      after += (corrected.imu[i].accel - clean.imu[i].accel).squaredNorm();
    }
    // A scale factor also scales the bias: 0.1 * 0.15 m/s^2 of it remains, for the bias' own
    // estimate.
    EXPECT_LT(after, 0.01 * before) << effect.id;
  }
}

}  // namespace
}  // namespace trueline::testing_simulation
