#include "cost_functions/models/imu_driven_model.h"

#include <gtest/gtest.h>

#include "cost_functions/models/complementary_filter.h"
#include "cost_functions/models/motion_block.h"
#include "tests/models/midpoint_step.h"

namespace trueline {
namespace {

// The accelerometer reading if B's origin has acceleration a_E, by eq. 6-7 and eq. 8: f_I = R_I_B
// R_B_E (a_E - g).
template <typename T>
Vector3<T> SpecificForceAtImu(const Matrix3<T>& R_E_B, const Matrix3<T>& R_B_I,
                              const Vector3<T>& a_E, double gravity) {
  return R_B_I.transpose() * (R_E_B.transpose() * (a_E - Vector3<T>(T(0), T(0), T(gravity))));
}

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kG = 9.81;

// A flight of the test's own: attitude and thrust as smooth functions of time.
Matrix3d AttitudeAt(double t) {
  return (AngleAxisd(0.8 * t, Vector3d::UnitZ()) *
          AngleAxisd(0.3 * std::sin(1.7 * t), Vector3d::UnitY()) *
          AngleAxisd(0.5 * std::sin(1.1 * t + 0.4), Vector3d::UnitX()))
      .toRotationMatrix();
}
double ThrustAt(double t) { return -10.5 - 1.5 * std::sin(2.3 * t); }

ImuDrivenParameters<double> TestParameters() {
  ImuDrivenParameters<double> p;
  p.K_x = -0.5;
  p.K_y = -0.7;
  p.b_az = 0.3;
  p.Phi_E_Ep = Vector3d(0.03, -0.02, 0.05);
  p.Phi_I_B = Vector3d(-0.02, 0.04, 0.03);
  return p;
}

// Independent reference of eq. 6, 9, 14, 15: rotations by quaternions, written out on its own.
Vector3d ReferenceAcceleration(double t, const Vector3d& v_E) {
  const auto turn = [](double phi, double theta, double psi) {
    return Quaterniond(AngleAxisd(psi, Vector3d::UnitZ())) *
           Quaterniond(AngleAxisd(theta, Vector3d::UnitY())) *
           Quaterniond(AngleAxisd(phi, Vector3d::UnitX()));
  };
  const Quaterniond q_E_B =
      turn(0.03, -0.02, 0.05) * Quaterniond(AttitudeAt(t)) * turn(-0.02, 0.04, 0.03);
  const Vector3d v_B = q_E_B.conjugate() * v_E;
  const Vector3d f_B(-0.5 * v_B.x(), -0.7 * v_B.y(), ThrustAt(t) - 0.3);
  return q_E_B * f_B + Vector3d(0, 0, kG);
}

// Reference trajectory: classical RK4 at a step far below the ones under test.
void ReferenceIntegrate(double t_end, Vector3d* p, Vector3d* v) {
  const double h = 5e-4;
  for (int i = 0; i < std::lround(t_end / h); ++i) {
    const double t = i * h;
    const Vector3d a1 = ReferenceAcceleration(t, *v);
    const Vector3d a2 = ReferenceAcceleration(t + h / 2, *v + a1 * h / 2);
    const Vector3d a3 = ReferenceAcceleration(t + h / 2, *v + a2 * h / 2);
    const Vector3d a4 = ReferenceAcceleration(t + h, *v + a3 * h);
    *p += *v * h + (a1 + a2 + a3) * h * h / 6.0;
    *v += (a1 + 2 * a2 + 2 * a3 + a4) * h / 6.0;
  }
}

TEST(ImuDrivenModel, AccelerationMatchesIndependentReference) {
  const ImuDrivenModel<double> model(TestParameters(), kG);
  for (const double t : {0.0, 0.7, 3.1}) {
    const Vector3d v(1.5, -2.0, 0.3);
    const Vector3d a = model.Acceleration({AttitudeAt(t), ThrustAt(t)}, v);
    EXPECT_LT((a - ReferenceAcceleration(t, v)).norm(), 1e-13);
  }
}

// What the accelerometer's z axis reads of any thrust and drag gives the acceleration back.
TEST(ImuDrivenModel, TheImusAxisHoldsAShareOfTheDrag) {
  const ImuDrivenParameters<double> p = TestParameters();
  const ImuDrivenModel<double> model(p, kG, ThrustAxis::kImu);
  const Vector3d v_E(1.5, -8.0, 0.3);
  const Matrix3d R_E_B = model.BodyToEarth(AttitudeAt(0.7));
  const Vector3d v_B = R_E_B.transpose() * v_E;
  const Vector3d a_E =
      R_E_B * Vector3d(p.K_x * v_B.x(), p.K_y * v_B.y(), -11.0) + Vector3d(0, 0, kG);
  const double read = SpecificForceAtImu<double>(R_E_B, model.R_B_I(), a_E, kG).z() + p.b_az;
  EXPECT_LT((model.Acceleration({AttitudeAt(0.7), read}, v_E) - a_E).norm(), 1e-12);
  const ImuDrivenModel<double> published(p, kG);
  EXPECT_GT((published.Acceleration({AttitudeAt(0.7), read}, v_E) - a_E).norm(), 0.1);
}

TEST(ImuDrivenModel, HoverStaysAndDragBrakes) {
  const ImuDrivenModel<double> model(ImuDrivenParameters<double>{-0.5, -0.7}, kG);
  const Drive hover{Matrix3d::Identity(), -kG};
  EXPECT_LT(model.Acceleration(hover, Vector3d::Zero()).norm(), 1e-14);
  EXPECT_LT((model.Acceleration(hover, Vector3d(2, 3, 0)) - Vector3d(-1.0, -2.1, 0)).norm(), 1e-14);
}

TEST(ImuDrivenModel, AccelerometerAtRestReadsMinusG) {
  const Vector3d f =
      SpecificForceAtImu<double>(Matrix3d::Identity(), Matrix3d::Identity(), Vector3d::Zero(), kG);
  EXPECT_EQ(f, Vector3d(0, 0, -kG));
}

double MidpointError(double dt) {
  const ImuDrivenModel<double> model(TestParameters(), kG);
  MotionState<double> state{Vector3d::Zero(), Vector3d(1.8, 0, 0)};
  Vector3d p = state.p, v = state.v;
  ReferenceIntegrate(4.0, &p, &v);
  for (int i = 0; i < std::lround(4.0 / dt); ++i) {
    const double t = (i + 0.5) * dt;
    MidpointStep(model, {AttitudeAt(t), ThrustAt(t)}, dt, &state);
  }
  return (state.p - p).norm();
}

TEST(Integrator, IsOfSecondOrder) {
  const double coarse = MidpointError(0.02), fine = MidpointError(0.01);
  EXPECT_NEAR(coarse / fine, 4.0, 0.4);
  EXPECT_LT(MidpointError(1.0 / 512.0), 1e-4);
}

// Blocks against direct midpoint steps on the very same drive: what is left is the blocks' own
// approximation (drag on a velocity that is linear in time).
double BlockError(double block_length, ThrustAxis axis = ThrustAxis::kBody) {
  const double dt = 1.0 / 512.0;
  const int per_block = std::max(1, static_cast<int>(std::lround(block_length / dt)));
  const ImuDrivenModel<double> model(TestParameters(), kG, axis);
  const BlockModel<double> block_model(model);
  MotionState<double> direct{Vector3d::Zero(), Vector3d(1.8, 0, 0)};
  MotionState<double> chained{Vector3d::Zero(), model.R_Ep_E() * direct.v};
  for (int i = 0; i < 5120 / per_block; ++i) {
    MotionBlock block{0.0, per_block * dt};
    for (int k = 0; k < per_block; ++k) {
      const double t = (i * per_block + k + 0.5) * dt;
      const Drive drive{AttitudeAt(t), ThrustAt(t)};
      MidpointStep(model, drive, dt, &direct);
      block.Append(drive, dt);
    }
    Propagate(block_model, block, &chained);
  }
  return (model.R_Ep_E().transpose() * chained.p - direct.p).norm();
}

TEST(MotionBlock, MatchesDirectIntegration) {
  EXPECT_LT(BlockError(1.0 / 512.0), 2e-5);  // a single step: the midpoint rules differ slightly
  EXPECT_LT(BlockError(0.05), 1e-3);
  EXPECT_LT(BlockError(0.05, ThrustAxis::kImu), 1e-3);
  EXPECT_LT(BlockError(0.1), 3e-3);
}

TEST(ComplementaryFilter, FindsLevelAndGyroBias) {
  using Filter = ComplementaryFilter<double>;
  const Vector3d bias(0.01, -0.02, 0.0);
  Filter filter({.k_p = 0.5, .k_i = 0.05}, Filter::LevelFrom(Vector3d(0, 0, -kG), 0.3));
  for (int i = 0; i < 512 * 200; ++i) filter.Step(bias, Vector3d(0, 0, -kG), 1.0 / 512.0);
  const Vector3d Phi = EulerFromQuaternion(filter.q_Ep_I());
  EXPECT_NEAR(Phi[0], 0.0, 1e-4);
  EXPECT_NEAR(Phi[1], 0.0, 1e-4);
  EXPECT_NEAR(filter.gyro_bias().x(), bias.x(), 1e-4);
  EXPECT_NEAR(filter.gyro_bias().y(), bias.y(), 1e-4);
}

TEST(ComplementaryFilter, LevelsByTheAccelerometerAtRest) {
  const Vector3d Phi(0.1, -0.2, 0.7);
  const Vector3d f = RotationFromEuler(Phi) * Vector3d(0, 0, -kG);
  const Quaterniond q = ComplementaryFilter<double>::LevelFrom(f, 0.7);
  EXPECT_LT((EulerFromQuaternion(q) - Phi).norm(), 1e-12);
}

// The AHRS error is not constant as the paper's model assumes: under acceleration a the tilt error
// is k_p a / g, which looks like drag.
TEST(ComplementaryFilter, TakesAccelerationForTilt) {
  const double k_p = 0.2, a = 1.0, seconds = 0.5;
  ComplementaryFilter<double> filter({.k_p = k_p, .k_i = 0.0}, Quaterniond::Identity());
  for (int i = 0; i < 256; ++i) {
    filter.Step(Vector3d::Zero(), Vector3d(a, 0, -kG), 1.0 / 512.0);
  }
  const double theta = EulerFromQuaternion(filter.q_Ep_I())[1];
  EXPECT_NEAR(theta, k_p * a / kG * seconds, 0.1 * k_p * a / kG * seconds);
}

}  // namespace
}  // namespace trueline
