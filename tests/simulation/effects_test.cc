// Every effect that an IMU-driven model sees against its definition, written out here. Effects on
// sensors leave the flight unchanged, so the log is compared with that of the same flight without
// them; force effects are checked in the true specific force.
#include <cmath>

#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_simulation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using simulation::TruthSample;

const Vector3d kDrag(-0.50, -0.55, -0.10);  // 1/s, of hippodrome_exact

Vector3d BodyVelocity(const TruthSample& sample, const Vector3d& wind_E = Vector3d::Zero()) {
  return sample.q_E_B.conjugate() * (sample.v_E - wind_E);
}

// `expected(sample)` is the added force in x and y; linear drag acts on the velocity `v_B`.
template <class VelocityOf, class Added>
void ExpectForce(const Flown& flown, const VelocityOf& velocity, const Added& added) {
  double largest = 0.0;
  for (const TruthSample& sample : flown.truth.trajectory) {
    const Vector3d v_B = velocity(sample);
    const Vector3d expected = kDrag.cwiseProduct(v_B) + added(sample, v_B);
    ASSERT_NEAR(sample.f_B.x(), expected.x(), 1e-9);
    ASSERT_NEAR(sample.f_B.y(), expected.y(), 1e-9);
    const Vector3d plain = kDrag.cwiseProduct(BodyVelocity(sample));
    largest = std::max(largest, (sample.f_B - plain).head<2>().norm());
  }
  EXPECT_GT(largest, 0.01);  // the effect is present
}

TEST(Effects, QuadraticDrag) {
  ExpectForce(
      FlyWith("quadratic_drag", {{"c", 0.05}}),
      [](const TruthSample& s) { return BodyVelocity(s); },
      [](const TruthSample&, const Vector3d& v) -> Vector3d { return -0.05 * v.norm() * v; });
}

TEST(Effects, RotorDrag) {
  ExpectForce(
      FlyWith("rotor_drag", {{"k", 0.03}}), [](const TruthSample& s) { return BodyVelocity(s); },
      [](const TruthSample& s, const Vector3d& v) -> Vector3d {
        const double thrust = -(s.f_B.z() + 0.10 * v.z());
        return -0.03 * thrust * v;
      });
}

TEST(Effects, Wind) {
  const Vector3d wind(1.0, -0.5, 0.0);
  ExpectForce(
      FlyWith("wind", {{"w_x", 1.0}, {"w_y", -0.5}}),
      [&](const TruthSample& s) { return BodyVelocity(s, wind); },
      [](const TruthSample&, const Vector3d&) -> Vector3d { return Vector3d::Zero(); });
}

TEST(Effects, DragStep) {
  ExpectForce(
      FlyWith("drag_step", {{"t_step", 6.0}, {"factor", 1.5}}),
      [](const TruthSample& s) { return BodyVelocity(s); },
      [](const TruthSample& s, const Vector3d& v) -> Vector3d {
        return s.t >= 6.0 ? Vector3d(0.5 * kDrag.cwiseProduct(v)) : Vector3d::Zero();
      });
}

class SensorEffects : public ::testing::Test {
 protected:
  // Both flights are the same flight.
  void Compare(const std::string& id, const std::map<std::string, double>& values) {
    plain = Fly(ShortExactFlight());
    with = FlyWith(id, values);
    ASSERT_EQ(plain.truth.trajectory.back().p_E, with.truth.trajectory.back().p_E);
  }
  // E' against E with the effect, seen from E' without it: R_E''_E'.
  Quaterniond AttitudeChange(std::size_t i) const {
    return with.log.attitude[i].q_Ep_I * plain.log.attitude[i].q_Ep_I.conjugate();
  }
  // psi of E' against E, all angles small: the logged heading is true heading minus psi.
  double PsiChange(std::size_t i) const {
    const Quaterniond change = AttitudeChange(i);
    return -2.0 * change.z() / change.w();
  }
  // Every fix is displaced by `shift(true pose at the time of the fix, gate)`.
  template <class Shift>
  void ExpectFixShift(const Shift& shift) const {
    ASSERT_EQ(plain.log.fixes.size(), with.log.fixes.size());
    ASSERT_GT(plain.log.fixes.size(), 20U);
    for (std::size_t i = 0; i < plain.log.fixes.size(); ++i) {
      const Fix& fix = plain.log.fixes[i];
      const auto k = static_cast<std::size_t>(std::lround(ToSeconds(fix.t) * 512.0));
      const Vector3d expected =
          shift(plain.truth.trajectory[k], plain.log.gates[fix.gate], fix.p_E);
      EXPECT_LT((with.log.fixes[i].p_E - fix.p_E - expected).norm(), 2e-3);
    }
  }

  Flown plain, with;
};

TEST_F(SensorEffects, AccelScaleZ) {
  Compare("accel_scale_z", {{"s", 0.02}});
  for (std::size_t i = 0; i < plain.log.imu.size(); ++i) {
    const double before = plain.log.imu[i].accel.z() - 0.15;  // b_az of the configuration
    ASSERT_NEAR(with.log.imu[i].accel.z(), 1.02 * before + 0.15, 1e-12);
    ASSERT_EQ(with.log.imu[i].accel.x(), plain.log.imu[i].accel.x());
  }
}

TEST_F(SensorEffects, AccelBiasDrift) {
  Compare("accel_bias_drift", {{"d", 0.01}});
  for (std::size_t i = 0; i < plain.log.imu.size(); ++i) {
    const double t = ToSeconds(plain.log.imu[i].t);
    ASSERT_NEAR(with.log.imu[i].accel.z() - plain.log.imu[i].accel.z(), 0.01 * t, 1e-9);
  }
}

// The IMU's own path, p + R r, differentiated twice: independent of the formula.
TEST_F(SensorEffects, ImuLeverArm) {
  const Vector3d r(0.05, -0.03, 0.02);
  Compare("imu_lever_arm", {{"r_x", r.x()}, {"r_y", r.y()}, {"r_z", r.z()}});
  const std::vector<TruthSample>& truth = with.truth.trajectory;
  const double rate = 512.0;
  double squares = 0.0, signal = 0.0;
  for (std::size_t i = 1; i + 1 < truth.size(); ++i) {
    const auto arm = [&](std::size_t k) -> Vector3d { return truth[k].q_E_B * r; };
    const Vector3d a_E = (arm(i + 1) - 2.0 * arm(i) + arm(i - 1)) * rate * rate;
    const Vector3d added = with.log.imu[i].accel - plain.log.imu[i].accel;
    squares += (added - truth[i].q_E_B.conjugate() * a_E).squaredNorm();
    signal += added.squaredNorm();
  }
  EXPECT_LT(squares, 1e-2 * signal);
}

// A filter of gain k that mistakes specific force for gravity tilts by k (v - mean v) / g: the z
// axis of E' tilts away from the acceleration. Integrate the low-pass here and compare z' in E.
TEST_F(SensorEffects, AhrsAccelerationError) {
  Compare("ahrs_acceleration_error", {{"k", 0.1}});
  std::vector<Vector3d> lean;
  for (std::size_t i = 0; i < with.truth.trajectory.size(); ++i) {
    const TruthSample& sample = with.truth.trajectory[i];
    const Quaterniond q_Ep_E_plain = simulation::FrameChange({0.012, -0.009, 0.020});
    const Quaterniond added = q_Ep_E_plain.conjugate() * AttitudeChange(i) * q_Ep_E_plain;
    lean.push_back(added.conjugate() * Vector3d::UnitZ());  // z' in E
    if (i == 0) continue;
    const Vector3d rate = (lean[i] - lean[i - 1]) * 512.0;
    const Vector3d expected = 0.1 * (-sample.a_E / 9.81 - lean[i]);
    EXPECT_NEAR(rate.x(), expected.x(), 1e-3);
    EXPECT_NEAR(rate.y(), expected.y(), 1e-3);
  }
}

// Where the drag lasts, the filter's tilt is that at which it does not decelerate: z' leans along
// the velocity by k v / g, once the loops have settled. At a turn within less than their time the
// tilt hardly follows.
TEST_F(SensorEffects, AhrsDragError) {
  Compare("ahrs_drag_error", {{"k", 0.3}});
  constexpr double kLoop = 2.0, kDamping = 0.7;  // rad/s; a low-pass of second order that is alike
  Eigen::Vector2d lean = Eigen::Vector2d::Zero(), rate = lean;
  double apart = 0.0, size = 0.0;
  for (std::size_t i = 1; i < with.truth.trajectory.size(); ++i) {
    const Eigen::Vector2d drag = -0.3 / 9.81 * with.truth.trajectory[i].v_E.head<2>();
    rate += (kLoop * kLoop * (drag - lean) - 2.0 * kDamping * kLoop * rate) / 512.0;
    lean += rate / 512.0;
    const Quaterniond q_Ep_E_plain = simulation::FrameChange({0.012, -0.009, 0.020});
    const Quaterniond added = q_Ep_E_plain.conjugate() * AttitudeChange(i) * q_Ep_E_plain;
    const Vector3d z = added.conjugate() * Vector3d::UnitZ();
    apart += (z.head<2>() - lean).squaredNorm();
    size += z.head<2>().squaredNorm();
  }
  EXPECT_LT(apart, 0.1 * size);
  EXPECT_GT(size, 0.0);
}

TEST_F(SensorEffects, HeadingDrift) {
  Compare("heading_drift", {{"d", 0.002}});
  for (std::size_t i = 0; i < plain.log.attitude.size(); i += 50) {
    ASSERT_NEAR(PsiChange(i), 0.002 * ToSeconds(plain.log.attitude[i].t), 1e-4);
  }
}

TEST_F(SensorEffects, HeadingDistortion) {
  Compare("heading_distortion", {{"a_sin", 0.03}, {"a_cos", -0.02}});
  for (std::size_t i = 0; i < plain.log.attitude.size(); i += 50) {
    const Vector3d nose = plain.truth.trajectory[i].q_E_B * Vector3d::UnitX();
    const double psi = std::atan2(nose.y(), nose.x());
    ASSERT_NEAR(PsiChange(i), 0.03 * std::sin(psi) - 0.02 * std::cos(psi), 1e-3);
  }
}

TEST_F(SensorEffects, AttitudeLatency) {
  Compare("attitude_latency", {{"tau", 10.0 / 512.0}});
  for (std::size_t i = 10; i < plain.log.attitude.size(); ++i) {
    ASSERT_LT(with.log.attitude[i].q_Ep_I.angularDistance(plain.log.attitude[i - 10].q_Ep_I), 1e-6);
  }
}

TEST_F(SensorEffects, FixLatency) {
  Compare("fix_latency", {{"tau", 0.08}});
  ASSERT_EQ(plain.log.fixes.size(), with.log.fixes.size());
  for (std::size_t i = 0; i < plain.log.fixes.size(); ++i) {
    EXPECT_NEAR(SecondsBetween(plain.log.fixes[i].t, with.log.fixes[i].t), 0.08, 2e-9);
    EXPECT_EQ(plain.log.fixes[i].p_E, with.log.fixes[i].p_E);  // so: measured at t - tau
  }
}

TEST_F(SensorEffects, FixScale) {
  Compare("fix_scale", {{"s", 0.1}});
  ExpectFixShift([](const TruthSample&, const Gate& gate, const Vector3d& p) -> Vector3d {
    return -0.1 * (gate.position - p);
  });
}

TEST_F(SensorEffects, CameraMisalignment) {
  Compare("camera_misalignment", {{"roll", 0.0}, {"pitch", 0.0}, {"yaw", 0.05}});
  ExpectFixShift([](const TruthSample& s, const Gate& gate, const Vector3d& p) -> Vector3d {
    const Vector3d u = s.q_E_B.conjugate() * (gate.position - p);
    // Turned to the right in body axes: x' = c x - s y, y' = s x + c y.
    const double c = std::cos(0.05), d = std::sin(0.05);
    const Vector3d turned(c * u.x() - d * u.y(), d * u.x() + c * u.y(), u.z());
    return -(s.q_E_B * (turned - u));
  });
}

TEST_F(SensorEffects, GateMoved) {
  plain = Fly(ShortExactFlight());
  with = FlyWith("gate_moved", {{"gate", 1}, {"dx", 0.1}, {"dy", -0.3}, {"dz", 0.2}});
  EXPECT_EQ(with.log.gates[1].position, plain.log.gates[1].position);  // the map is unchanged
  int moved = 0;
  for (const Fix& fix : with.log.fixes) {
    const auto k = static_cast<std::size_t>(std::lround(ToSeconds(fix.t) * 512.0));
    const Vector3d off = fix.p_E - with.truth.trajectory[k].p_E;
    const Vector3d expected = fix.gate == 1 ? Vector3d(-0.1, 0.3, -0.2) : Vector3d::Zero();
    EXPECT_LT((off - expected).norm(), 3e-3);
    moved += fix.gate == 1 ? 1 : 0;
  }
  EXPECT_GT(moved, 10);
}

TEST_F(SensorEffects, FalseGate) {
  SimulationConfig config = ReadShipped("hippodrome_exact");
  config.detector.sigma_factor = 0.0;
  config.detector.sigma_floor = 1e-9;
  config.effects = {{"false_gate", {{"fraction", 0.3}, {"dx", 0.5}, {"dy", 1.0}}}};
  with = Fly(config);
  int wrong = 0;
  for (const Fix& fix : with.log.fixes) {
    const auto k = static_cast<std::size_t>(std::lround(ToSeconds(fix.t) * 512.0));
    const Vector3d off = fix.p_E - with.truth.trajectory.at(k).p_E;
    const bool is_wrong = off.norm() > 0.5;
    wrong += is_wrong ? 1 : 0;
    EXPECT_LT((off - (is_wrong ? Vector3d(-0.5, -1.0, 0.0) : Vector3d::Zero())).norm(), 3e-3);
  }
  const auto count = static_cast<double>(with.log.fixes.size());
  EXPECT_NEAR(wrong / count, 0.3, 4.0 * std::sqrt(0.21 / count));
}

}  // namespace
}  // namespace trueline::testing_simulation
