#include "problems/rotor/rotor_slopes.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "cost_functions/models/rotation.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

using Model = RotorAeroModel;
using Base = RotorDrivenModel;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using StateJet = ceres::Jet<double, 4>;
using Vector4 = Vec4<double>;

constexpr int kMovingStates = Model::kMoving;
using StateSlope = Eigen::Matrix<double, kMovingStates, kMovingStates>;

// Force [m/s^2] and angular acceleration [rad/s^2], and their derivatives by the state. Columns of
// constants that are not asked for are zero.
struct BodyAccelerationSlope {
  Eigen::Matrix<double, 6, 1> value;
  Eigen::Matrix<double, 6, Model::kStates> by;
};

// The matrix of RotateByUnit(q, .), and the derivative of RotateByUnit(q, v) by q.
Matrix3d RotationOf(const Vector4& q) {
  Matrix3d R;
  for (int k = 0; k < 3; ++k) R.col(k) = RotateByUnit<double>(q, Vector3d::Unit(k));
  return R;
}
Eigen::Matrix<double, 3, 4> RotationSlope(const Vector4& q, const Vector3d& v) {
  const Vector3d u = q.tail<3>();
  const Vector3d inner = u.cross(v) + q[0] * v;
  Eigen::Matrix<double, 3, 4> slope;
  slope.col(0) = 2.0 * u.cross(v);
  slope.rightCols<3>() = -2.0 * (Skew<double>(inner) + v * u.transpose());
  slope.rightCols<3>().diagonal().array() += 2.0 * u.dot(v);
  return slope;
}

// By the attitude: the velocity in body axes turns with it.
Eigen::Matrix<double, 6, 4> ByAttitude(const RotorState& x,
                                       const Eigen::Matrix<double, 6, 3>& by_velocity) {
  const Vector4 back = Conjugate(Vector4(x.head<4>()));
  Eigen::Matrix<double, 3, 4> turned = RotationSlope(back, x.segment<3>(Base::kVelocity));
  turned.rightCols<3>() *= -1.0;
  return by_velocity * (RotationOf(back).inverse() * turned);
}

BodyAccelerationSlope SlopeOfBodyAcceleration(const RotorAeroModel& model, const RotorState& x,
                                              const RotorInput& input,
                                              std::span<const int> states) {
  const Model::InputSums over = model.SumOver(input);
  BodyAccelerationSlope slope;
  slope.by.setZero();
  std::array<StateJet, Model::kStates> at;
  for (int i = 0; i < Model::kStates; ++i) at[i] = StateJet(x[i]);
  // Terms of the open catalogue go with attitude and place, too.
  static constexpr std::array<int, 6> kPose = {0, 1, 2, 3, Base::kPosition, Base::kPosition + 1};
  std::span<const int> more = model.effects().terms.empty() ? std::span<const int>() : kPose;
  while (!states.empty() || !more.empty()) {
    if (states.empty()) states = std::exchange(more, {});
    const auto some = states.first(std::min<std::size_t>(StateJet::DIMENSION, states.size()));
    for (std::size_t j = 0; j < some.size(); ++j) at[some[j]].v[static_cast<int>(j)] = 1.0;
    const Model::BodyAcceleration<StateJet> acceleration =
        model.BodyAccelerationOf(at.data(), input, over);
    for (int i = 0; i < 6; ++i) {
      const StateJet& y = i < 3 ? acceleration.force[i] : acceleration.turn[i - 3];
      slope.value[i] = y.a;
      for (std::size_t j = 0; j < some.size(); ++j) slope.by(i, some[j]) = y.v[static_cast<int>(j)];
    }
    for (const int state : some) at[state].v.setZero();
    states = states.subspan(some.size());
  }
  if (model.effects().terms.empty()) {
    slope.by.leftCols<4>() = ByAttitude(x, slope.by.middleCols<3>(Base::kVelocity));
  }
  return slope;
}

// d(quaternion) / d(attitude error).
Eigen::Matrix<double, 4, 3> QuaternionSlope(const RotorState& x) {
  const Vector4 q = x.head<4>();
  Eigen::Matrix<double, 4, 3> slope;
  for (int k = 0; k < 3; ++k) slope.col(k) = TimesPure<double>(q, 0.5 * Vector3d::Unit(k));
  return slope;
}

// dx/dt of the moving state and its derivatives.
struct Flow {
  Eigen::Matrix<double, kMovingStates, 1> dx;
  StateSlope by_state;
  Eigen::Matrix<double, 6, Model::kConstants> by_constants;  // of velocity and rate; others: zero
};

Flow FlowAt(const RotorAeroModel& model, const RotorState& x, const RotorInput& input,
            const Eigen::Matrix<double, 6, 1>& disturbance, const SlopeColumns& columns) {
  const BodyAccelerationSlope acceleration =
      SlopeOfBodyAcceleration(model, x, input, columns.States(input));
  const Vector3d force = acceleration.value.head<3>() + disturbance.head<3>();
  const Vector3d turn = acceleration.value.tail<3>() + disturbance.tail<3>();
  const Vector4 q = x.head<4>();
  const Vector3d w = x.segment<3>(Base::kRate);
  const Matrix3d R = RotationOf(q);
  Flow flow;
  model.base().Move(x.data(), force, turn, flow.dx.data());
  StateSlope& by = flow.by_state;
  by.setZero();
  for (int k = 0; k < 4; ++k) by.col(k).head<4>() = 0.5 * TimesPure<double>(Vector4::Unit(k), w);
  by.block<4, 3>(0, Base::kRate) = QuaternionSlope(x);
  by.block<3, 3>(Base::kPosition, Base::kVelocity).setIdentity();
  by.middleRows<3>(Base::kVelocity) =
      R.lazyProduct(acceleration.by.topLeftCorner<3, kMovingStates>());
  by.block<3, 4>(Base::kVelocity, 0) += RotationSlope(q, force);
  by.middleRows<3>(Base::kRate) = acceleration.by.bottomLeftCorner<3, kMovingStates>();
  flow.by_constants.topRows<3>() =
      R.lazyProduct(acceleration.by.topRightCorner<3, Model::kConstants>());
  flow.by_constants.bottomRows<3>() = acceleration.by.bottomRightCorner<3, Model::kConstants>();
  return flow;
}

// From the state's columns to those of its error.
template <int kRows>
Eigen::Matrix<double, kRows, Model::kMovingErrors> ByError(
    const RotorState& x, const Eigen::Matrix<double, kRows, kMovingStates>& by) {
  Eigen::Matrix<double, kRows, Model::kMovingErrors> slope;
  slope.template leftCols<3>() = by.template leftCols<4>().lazyProduct(QuaternionSlope(x));
  slope.template rightCols<kMovingStates - 4>() = by.template rightCols<kMovingStates - 4>();
  return slope;
}

// d(attitude error) / d(quaternion).
Eigen::Matrix<double, 3, 4> AttitudeSlope(const RotorState& x) {
  // Between steps the quaternion's length is not exactly one.
  const Vector4 back = Conjugate(Vector4(x.head<4>())) / x.head<4>().squaredNorm();
  Eigen::Matrix<double, 3, 4> slope;
  for (int k = 0; k < 4; ++k) {
    slope.col(k) = 2.0 * HamiltonProduct<double>(back, Vector4::Unit(k)).tail<3>();
  }
  return slope;
}

// From the rows of the moving state to those of its error.
template <int kCols>
Eigen::Matrix<double, Model::kMovingErrors, kCols> OfError(
    const Eigen::Matrix<double, 3, 4>& attitude,
    const Eigen::Matrix<double, kMovingStates, kCols>& of) {
  Eigen::Matrix<double, Model::kMovingErrors, kCols> slope;
  slope.template topRows<3>() = attitude.lazyProduct(of.template topRows<4>());
  slope.template bottomRows<kMovingStates - 4>() = of.template bottomRows<kMovingStates - 4>();
  return slope;
}

}  // namespace

std::vector<int> AllRotorConstants() {
  std::vector<int> all(Model::kConstants);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

SlopeColumns::SlopeColumns(const std::vector<int>& constants) {
  const auto add = [&](RotorConstantGroup group) {
    for (const int i : constants) {
      if (kRotorConstants[i].group == group) states_[all_++] = Model::kMoving + i;
    }
    return all_;
  };
  motors_ = add(RotorConstantGroup::kCommands);
  constants_ = add(RotorConstantGroup::kMotion);
  // Height, velocity, rate; the attitude's columns follow from the velocity's.
  for (int i = Base::kPosition + 2; i < Base::kRate + 3; ++i) states_[all_++] = i;
}

const SlopeColumns& SlopeColumns::All() {
  static const SlopeColumns all(AllRotorConstants());
  return all;
}

std::span<const int> SlopeColumns::States(const RotorInput& input) const {
  const std::size_t first = input.slopes.empty() ? motors_ : 0;
  return std::span(states_).subspan(first, all_ - first);
}

std::span<const int> SlopeColumns::Constants(const RotorInput& input) const {
  const std::size_t first = input.slopes.empty() ? motors_ : 0;
  return std::span(states_).subspan(first, constants_ - first);
}

// The accelerometer at the arm r from the centre of mass reads f + dw x r + w x (w x r).
RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input, const Eigen::Vector3d& drift,
                           const SlopeColumns& columns) {
  BodyAccelerationSlope acceleration =
      SlopeOfBodyAcceleration(model, x, input, columns.States(input));
  const Vector3d force = acceleration.value.head<3>(), turn = acceleration.value.tail<3>() + drift;
  const Vector3d w = x.segment<3>(Base::kRate);
  const Vector3d arm = ImuArmOf(x);
  RotorReading reading;
  Base::Read(x.data(), force, turn, reading.y.data());
  auto by = acceleration.by.topRows<3>();
  by -= Skew<double>(arm).lazyProduct(acceleration.by.bottomRows<3>());
  by.middleCols<3>(Base::kRate) -= Skew<double>(w.cross(arm)) + Skew<double>(w) * Skew<double>(arm);
  const Matrix3d by_arm = Skew<double>(turn) + Skew<double>(w) * Skew<double>(w);
  by.middleCols<3>(Base::kImuArm) += by_arm;
  by.middleCols<3>(Base::kCentre) -= by_arm;
  acceleration.by.bottomRows<3>().setZero();
  acceleration.by.block<3, 3>(3, Base::kRate).setIdentity();
  acceleration.by.middleCols<6>(Base::kAccelBias).setIdentity();
  reading.slope.leftCols<Model::kMovingErrors>() =
      ByError<6>(x, acceleration.by.leftCols<kMovingStates>());
  reading.slope.rightCols<Model::kConstants>() = acceleration.by.rightCols<Model::kConstants>();
  return reading;
}

RotorStepSlope StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                             const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                             RotorState* x, const SlopeColumns& columns) {
  const RotorState start = *x;
  const Flow first = FlowAt(model, start, input, disturbance, columns);
  RotorState middle = start;
  middle.head<kMovingStates>() += (0.5 * dt) * first.dx;
  const Flow second = FlowAt(model, middle, input, disturbance, columns);
  x->head<kMovingStates>() += dt * second.dx;

  const Eigen::Matrix<double, 3, 4> attitude = AttitudeSlope(*x);
  StateSlope by_state = StateSlope::Identity() + dt * second.by_state;
  AddProduct(0.5 * dt * dt, second.by_state, first.by_state, by_state);
  RotorStepSlope slope;
  slope.by_error.setZero();
  slope.by_error.leftCols<Model::kMovingErrors>() =
      OfError<Model::kMovingErrors>(attitude, ByError<kMovingStates>(start, by_state));
  Eigen::Matrix<double, kMovingStates, 6> first_added =
      (0.5 * dt * dt) * second.by_state.middleCols<6>(Base::kVelocity);
  first_added.leftCols<3>() *= AttitudeOf(start);
  slope.by_first = OfError<6>(attitude, first_added);
  Eigen::Matrix<double, kMovingStates, 6> second_added =
      Eigen::Matrix<double, kMovingStates, 6>::Zero();
  second_added.block<3, 3>(Base::kVelocity, 0) = dt * AttitudeOf(middle);
  second_added.block<3, 3>(Base::kRate, 3).diagonal().setConstant(dt);
  slope.by_second = OfError<6>(attitude, second_added);
  slope.middle = middle;
  for (const int state : columns.Constants(input)) {
    const int constant = state - Model::kMoving;
    Eigen::Matrix<double, kMovingStates, 1> moved = Eigen::Matrix<double, kMovingStates, 1>::Zero();
    moved.segment<6>(Base::kVelocity) = dt * second.by_constants.col(constant);
    AddProduct(0.5 * dt * dt, second.by_state.middleCols<6>(Base::kVelocity),
               first.by_constants.col(constant), moved);
    slope.by_error.col(Model::kMovingErrors + constant) = OfError<1>(attitude, moved);
  }
  return slope;
}

}  // namespace trueline
