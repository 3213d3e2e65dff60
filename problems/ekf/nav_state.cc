#include "problems/ekf/nav_state.h"

#include <ceres/jet.h>

#include "cost_functions/models/rotation.h"

namespace trueline {
namespace {

constexpr int kSeeds = 9;  // attitude, b_a, b_g
using NavJet = ceres::Jet<double, kSeeds>;

Vector3<NavJet> Seeded(const Eigen::Vector3d& value, int first) {
  return {NavJet(value[0], first), NavJet(value[1], first + 1), NavJet(value[2], first + 2)};
}

Eigen::Vector3d ValueOf(const Vector3<NavJet>& x) { return {x[0].a, x[1].a, x[2].a}; }

void StoreRows(const Vector3<NavJet>& x, int first_row, Transition* transition) {
  for (int i = 0; i < 3; ++i) transition->tail.row(first_row + i) = x[i].v.transpose();
}

template <class State>
void StoreMotion(const State& x, NavState* next, Transition* transition) {
  next->motion.p = ValueOf(x.p);
  next->motion.v = ValueOf(x.v);
  StoreRows(x.p, 0, transition);
  StoreRows(x.v, 3, transition);
}

ImuBias<NavJet> SeededBias(const NavState& x) {
  return {Seeded(x.bias.accel, 3), Seeded(x.bias.gyro, 6)};
}

NavState AdvanceErrorState(const NavState& x, const ImuInput& imu, double gravity, double dt,
                           Transition* transition) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  KinematicState<NavJet> motion;
  motion.p = x.motion.p.cast<NavJet>();
  motion.v = x.motion.v.cast<NavJet>();
  motion.q_E_I =
      x.motion.q_E_I.cast<NavJet>() * RotationFromHalfVector<NavJet>(Seeded(zero, 0) * NavJet(0.5));
  KinematicStep(imu, SeededBias(x), gravity, dt, &motion);

  NavState next = x;
  StoreMotion(motion, &next, transition);
  const Eigen::Quaternion<NavJet>& q = motion.q_E_I;
  next.motion.q_E_I = Eigen::Quaterniond(q.w().a, q.x().a, q.y().a, q.z().a).normalized();
  // Twice the vector part of the small rotation between the new nominal attitude and q.
  const Eigen::Quaternion<NavJet> error = next.motion.q_E_I.conjugate().cast<NavJet>() * q;
  StoreRows(error.vec() * NavJet(2.0), 6, transition);
  return next;
}

NavState AdvanceEuler(const NavState& x, const ImuInput& imu, double gravity, double dt,
                      Transition* transition) {
  EulerKinematicState<NavJet> motion;
  motion.p = x.motion.p.cast<NavJet>();
  motion.v = x.motion.v.cast<NavJet>();
  motion.Phi = Seeded(EulerFromQuaternion(x.motion.q_E_I), 0);
  KinematicStep(imu, SeededBias(x), gravity, dt, &motion);

  NavState next = x;
  StoreMotion(motion, &next, transition);
  next.motion.q_E_I = QuaternionFromEuler(ValueOf(motion.Phi));
  StoreRows(motion.Phi, 6, transition);
  return next;
}

}  // namespace

Matrix15d Transition::Dense() const {
  Matrix15d F = Matrix15d::Identity();
  F.block<3, 3>(0, 3) = Eigen::Matrix3d::Identity() * dt;
  F.block<9, 9>(0, 6) = tail;
  return F;
}

NavState Advance(AttitudeForm form, const NavState& x, const ImuInput& imu, double gravity,
                 double dt, Transition* transition) {
  transition->dt = dt;
  return form == AttitudeForm::kEuler ? AdvanceEuler(x, imu, gravity, dt, transition)
                                      : AdvanceErrorState(x, imu, gravity, dt, transition);
}

NavState Moved(AttitudeForm form, const NavState& x, const Vector15d& error) {
  NavState moved = x;
  moved.motion.p += error.segment<3>(0);
  moved.motion.v += error.segment<3>(3);
  moved.bias.accel += error.segment<3>(9);
  moved.bias.gyro += error.segment<3>(12);
  const Eigen::Vector3d turn = error.segment<3>(6);
  if (form == AttitudeForm::kEuler) {
    moved.motion.q_E_I = QuaternionFromEuler<double>(EulerFromQuaternion(x.motion.q_E_I) + turn);
  } else {
    moved.motion.q_E_I = (x.motion.q_E_I * RotationByVector(turn)).normalized();
  }
  return moved;
}

Eigen::Matrix3d AttitudeErrorFromEarth(AttitudeForm form, const NavState& x) {
  Eigen::Matrix3d R_I_E = x.motion.q_E_I.conjugate().toRotationMatrix();
  if (form == AttitudeForm::kErrorState) return R_I_E;
  return EulerRateFromBodyRate<double>(EulerFromQuaternion(x.motion.q_E_I)) * R_I_E;
}

}  // namespace trueline
