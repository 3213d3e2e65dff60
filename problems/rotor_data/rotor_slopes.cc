#include "problems/rotor_data/rotor_slopes.h"

#include "cost_functions/models/rotation.h"
#include "problems/rotor_data/rotor_step.h"

namespace trueline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Model = RotorAeroModel;
using Base = RotorDrivenModel;
using Rows3 = Eigen::Matrix<double, 3, Model::kErrors>;

// Columns of the error state.
enum Column : int { kTheta = 0, kPlace = 3, kSpeed = 6, kTurn = 9 };
constexpr int ColumnOf(int state) { return state - 1; }  // of what is no attitude

Matrix3d Cross3(const Vector3d& v) { return Skew<double>(v); }

Matrix3d RotationOf(const RotorState& x) {
  return Eigen::Quaterniond(x[0], x[1], x[2], x[3]).normalized().toRotationMatrix();
}

// Force and moment of the rotors, in N and N m about M.
struct WrenchSlope {
  Vector3d force, moment;
  Rows3 d_force = Rows3::Zero(), d_moment = Rows3::Zero();
};

WrenchSlope RotorWrench(const Model& model, const RotorState& x, const RotorInput& input) {
  const Base::RotorSums<double> sums = model.SumsOf(x.data(), input);
  const double k_f = x[Base::kThrustScale], k_m = x[Base::kTorqueScale];
  const Vector3d centre = x.segment<3>(Base::kCentre);
  WrenchSlope w{k_f * sums.force, {}};
  w.moment = k_f * sums.lever + k_m * sums.reaction - centre.cross(w.force);
  const auto add = [&](int column, const Vector3d& force, const Vector3d& moment) {
    w.d_force.col(column) += force;
    w.d_moment.col(column) += moment - centre.cross(force);
  };
  add(ColumnOf(Base::kThrustScale), sums.force, sums.lever);
  add(ColumnOf(Base::kTorqueScale), Vector3d::Zero(), sums.reaction);
  w.d_moment.middleCols<3>(ColumnOf(Base::kCentre)) = Cross3(w.force);
  using Height = ceres::Jet<double, 1>;
  const Height ground = model.effects().GroundFactor(Height(-x[Base::kPosition + 2], 0));
  const double by_height = -ground.v[0] / ground.a;  // of the logarithm, by z
  if (by_height != 0.0) {
    add(kPlace + 2, by_height * w.force, by_height * k_f * sums.lever);
  }
  if (input.slopes.empty()) return w;
  for (int j = 0; j < kMotorUnknowns; ++j) {
    const Base::RotorSums<double> slope = model.SumSlopes(input, j);
    add(ColumnOf(Model::kMotors + j), k_f * ground.a * slope.force,
        k_f * ground.a * slope.lever + k_m * slope.reaction);
  }
  return w;
}

// What the air does beyond thrust: specific force, and moment [N m].
void AddAir(const Model& model, const RotorState& x, const RotorInput& input, const Matrix3d& R,
            WrenchSlope* w, RotorPush* push) {
  using Air = ceres::Jet<double, 3>;
  const Vector3d v_B = R.transpose() * x.segment<3>(Base::kVelocity);
  const Vec3<Air> v(Air(v_B[0], 0), Air(v_B[1], 1), Air(v_B[2], 2));
  const double sum = Model::SumOf(input);
  const Vec3<Air> force = model.effects().AirForce(v, sum);
  const Vec3<Air> moment = model.effects().AirMoment(v);
  Matrix3d d_force, d_moment;
  for (int i = 0; i < 3; ++i) {
    d_force.row(i) = force[i].v.transpose();
    d_moment.row(i) = moment[i].v.transpose();
    w->moment[i] += moment[i].a;
    push->force[i] += force[i].a;
  }
  const Vector3d K(x[Model::kDrag], x[Model::kDrag + 1],
                   x[Model::kDrag + 2] - sum * x[Model::kInflow]);
  d_force.diagonal() += K;
  push->force += K.cwiseProduct(v_B);
  const Matrix3d by_theta = Cross3(v_B);
  auto rows = push->slope.topRows<3>();
  rows.middleCols<3>(kTheta) += d_force * by_theta;
  rows.middleCols<3>(kSpeed) += d_force * R.transpose();
  for (int i = 0; i < 3; ++i) rows(i, ColumnOf(Model::kDrag + i)) += v_B[i];
  rows(2, ColumnOf(Model::kInflow)) -= sum * v_B[2];
  w->d_moment.middleCols<3>(kTheta) += d_moment * by_theta;
  w->d_moment.middleCols<3>(kSpeed) += d_moment * R.transpose();
}

// A centre of mass that has moved by `c`: moments are about it, and p_E_M stays where it was.
void ShiftCentre(const Vector3d& c, const Vector3d& w, RotorPush* push) {
  auto force = push->slope.topRows<3>();
  push->force -= push->turn.cross(c) + w.cross(w.cross(c));
  force += Cross3(c) * push->slope.bottomRows<3>();
  force.middleCols<3>(kTurn) -=
      w.dot(c) * Matrix3d::Identity() + w * c.transpose() - 2.0 * c * w.transpose();
}

}  // namespace

RotorPush PushWithSlope(const RotorAeroModel& model, const RotorState& x, const RotorInput& input) {
  const Matrix3d R = RotationOf(x);
  WrenchSlope wrench = RotorWrench(model, x, input);
  const double mass = x[Base::kMass] + model.effects().AddedMass(input.t);
  RotorPush push;
  push.force = wrench.force / mass;
  push.slope.setZero();
  push.slope.topRows<3>() = wrench.d_force / mass;
  push.slope.col(ColumnOf(Base::kMass)).head<3>() = -push.force / mass;
  AddAir(model, x, input, R, &wrench, &push);
  const Vector3d shift = model.effects().CentreShift(input.t);
  if (!shift.isZero(0.0)) {
    wrench.moment -= shift.cross(wrench.force);
    wrench.d_moment -= Cross3(shift) * wrench.d_force;
  }
  const Vector3d w = x.segment<3>(Base::kRate), inertia = x.segment<3>(Base::kInertia);
  const Vector3d momentum = inertia.cwiseProduct(w), per = inertia.cwiseInverse();
  push.turn = per.cwiseProduct(wrench.moment - w.cross(momentum));
  auto turn = push.slope.bottomRows<3>();
  turn = wrench.d_moment;
  turn.middleCols<3>(kTurn) += Cross3(momentum) - Cross3(w) * inertia.asDiagonal();
  turn.middleCols<3>(ColumnOf(Base::kInertia)) -= Cross3(w) * w.asDiagonal();
  turn = (per.asDiagonal() * turn).eval();
  for (int i = 0; i < 3; ++i) turn(i, ColumnOf(Base::kInertia + i)) -= per[i] * push.turn[i];
  if (!shift.isZero(0.0)) ShiftCentre(shift, w, &push);
  return push;
}

RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input) {
  const RotorPush push = PushWithSlope(model, x, input);
  const Vector3d w = x.segment<3>(Base::kRate);
  const Vector3d arm = x.segment<3>(Base::kImuArm) - x.segment<3>(Base::kCentre);
  RotorReading reading;
  Base::Read(x.data(), push.force, push.turn, reading.y.data());
  auto accel = reading.slope.topRows<3>();
  const Matrix3d by_arm = Cross3(push.turn) + Cross3(w) * Cross3(w);
  accel = push.slope.topRows<3>() - Cross3(arm) * push.slope.bottomRows<3>();
  accel.middleCols<3>(kTurn) +=
      w.dot(arm) * Matrix3d::Identity() + w * arm.transpose() - 2.0 * arm * w.transpose();
  accel.middleCols<3>(ColumnOf(Base::kImuArm)) += by_arm;
  accel.middleCols<3>(ColumnOf(Base::kCentre)) -= by_arm;
  accel.middleCols<3>(ColumnOf(Base::kAccelBias)) += Matrix3d::Identity();
  reading.slope.bottomRows<3>().setZero();
  reading.slope.block<3, 3>(3, kTurn).setIdentity();
  reading.slope.block<3, 3>(3, ColumnOf(Base::kGyroBias)).setIdentity();
  return reading;
}

namespace {

// d(2 vec(s^* ds) / |s|^2) for s = (a, b) moved by ds: the turn of a quaternion's own frame.
Eigen::Matrix<double, 3, 4> TurnOf(const Vec4<double>& s) {
  Eigen::Matrix<double, 3, 4> turn;
  const Vector3d b = s.tail<3>();
  turn.col(0) = -b;
  turn.rightCols<3>() = s[0] * Matrix3d::Identity() - Cross3(b);
  return 2.0 / s.squaredNorm() * turn;
}

Matrix3d RotationOf(const Vec4<double>& s) {
  return Eigen::Quaterniond(s[0], s[1], s[2], s[3]).normalized().toRotationMatrix();
}

Eigen::Matrix<double, 4, 3> Stacked(const Eigen::RowVector3d& top, const Matrix3d& bottom) {
  Eigen::Matrix<double, 4, 3> stacked;
  stacked << top, bottom;
  return stacked;
}

}  // namespace

// q_m = q s with s = (1, dt/4 w), and q_1 = q S with S = 1 + dt/2 s (0, w_m): the two halves of the
// midpoint rule.
RotorStepMatrix StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                              const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                              RotorState* x) {
  constexpr int kConstants = Model::kConstants, kFirst = Model::kMovingErrors;
  const RotorState start = *x;
  RotorMidpointStep(model, input, disturbance.data(), dt, x->data());
  RotorPush first = PushWithSlope(model, start, input);
  first.force += disturbance.head<3>();
  first.turn += disturbance.tail<3>();
  Eigen::Matrix<double, Model::kMoving, 1> rate;
  model.base().Move(start.data(), Vec3<double>(first.force), Vec3<double>(first.turn), rate.data());
  RotorState middle = start;
  middle.head<Model::kMoving>() += 0.5 * dt * rate;
  RotorPush second = PushWithSlope(model, middle, input);
  second.force += disturbance.head<3>();

  const Vector3d w = start.segment<3>(Base::kRate), w_m = middle.segment<3>(Base::kRate);
  const double quarter = 0.25 * dt;
  const Matrix3d R = RotationOf(start), R_m = RotationOf(middle);
  Vec4<double> s;
  s << 1.0, quarter * w;
  // The middle.
  RotorStepMatrix at = RotorStepMatrix::Zero();
  at.leftCols<kFirst>().setIdentity();
  at.block<3, 3>(kTheta, kTheta) = RotationOf(s).transpose();
  at.block<3, 3>(kTheta, kTurn) = quarter * TurnOf(s).rightCols<3>();
  at.block<3, 3>(kPlace, kSpeed) = 0.5 * dt * Matrix3d::Identity();
  at.middleRows<3>(kSpeed) += 0.5 * dt * R * first.slope.topRows<3>();
  at.block<3, 3>(kSpeed, kTheta) -= 0.5 * dt * R * Cross3(first.force);
  at.middleRows<3>(kTurn) += 0.5 * dt * first.slope.bottomRows<3>();
  // The end.
  RotorPushMatrix push = second.slope.leftCols<kFirst>() * at;
  push.rightCols<kConstants>() += second.slope.rightCols<kConstants>();
  const Vec4<double> S = Vec4<double>(1, 0, 0, 0) + 0.5 * dt * TimesPure(s, w_m);
  const Eigen::Matrix<double, 3, 4> turn = TurnOf(S);
  RotorStepMatrix end = RotorStepMatrix::Zero();
  end.leftCols<kFirst>().setIdentity();
  end.middleRows<3>(kTheta) =
      turn *
      (0.5 * dt * Stacked(-quarter * w.transpose(), Matrix3d::Identity() + quarter * Cross3(w))) *
      at.middleRows<3>(kTurn);
  end.block<3, 3>(kTheta, kTurn) +=
      turn * (0.5 * dt * quarter * Stacked(-w_m.transpose(), -Cross3(w_m)));
  end.block<3, 3>(kTheta, kTheta) += RotationOf(S).transpose();
  end.middleRows<3>(kPlace) += dt * at.middleRows<3>(kSpeed);
  end.middleRows<3>(kSpeed) +=
      dt * R_m * (push.topRows<3>() - Cross3(second.force) * at.middleRows<3>(kTheta));
  end.middleRows<3>(kTurn) += dt * push.bottomRows<3>();
  return end;
}

}  // namespace trueline
