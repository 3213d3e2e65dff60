// A trajectory in flat outputs, flown by a rotor-driven vehicle: its states, inputs and their
// series.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <utility>
#include <vector>

#include "cost_functions/models/rotor_driven_model.h"
#include "cost_functions/numbers/taylor.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

// States and inputs along a flight, for the Gramians.
struct NominalPoint {
  std::vector<double> x;  // a system's states
  std::vector<double> u;  // its inputs
};

struct NominalFlight {
  double start = 0.0;  // s
  double end = 0.0;
  std::function<NominalPoint(double t)> at;
};

// Differential flatness of a multirotor with parallel rotors (Mellinger and Kumar 2011), in NED:
// maps power series of the centre of mass's position and of yaw to power series of attitude, body
// rates and squared rotor speeds. Series of doubles give states and inputs with all their
// derivatives; series of Variables also their gradients. Yaw is the heading of the nose (rotations
// about z, then y, then x); Mellinger and Kumar rotate z, x, y.

// The vehicle's data for the flat map.
struct FlatVehicle {
  double mass = 0.0;        // kg
  Eigen::Vector3d inertia;  // kg m^2
  double gravity = 9.81;    // m/s^2
  // n x 4: squared rotor speeds from (upward thrust, moments about M): the pseudo-inverse of the
  // allocation, so the smallest speeds where there are more than four rotors.
  Eigen::Matrix<double, Eigen::Dynamic, 4> speeds_from_wrench;
};

// `parameters` are the model's kStates numbers. Throws InputError where rotors are not parallel to
// the body's z axis (such a vehicle is not flat in these outputs) or can't turn it about each axis.
FlatVehicle MakeFlatVehicle(const RotorDrivenModel& model, const std::vector<double>& parameters);

template <class S>
struct FlatState {
  Vec4<S> q;         // q_E_M
  Vec3<S> p, v, w;   // m, m/s in E; rad/s in body axes
  S cos_tilt;        // of the angle between body z and down
  std::vector<S> u;  // squared rotor speeds
};

// The earth's down axis in body axes: (-sin(pitch), sin(roll) cos(pitch), cos(roll) cos(pitch)).
template <class C>
struct DownInBody {
  C x, y, z;
};
template <class C, class S>
DownInBody<C> DownInBodyOf(const FlatState<S>& state) {
  const C w = state.q[0][0], x = state.q[1][0], y = state.q[2][0], z = state.q[3][0];
  const C two(2.0);
  return {two * (x * z - w * y), two * (y * z + w * x), state.cos_tilt[0]};
}

// `flat` (x, y, z, yaw) known to order k + 4 gives w to order k + 1 and u to order k. Thrust must
// not be zero, and roll must stay below 90 deg.
template <class S>
FlatState<S> StateFromFlat(const FlatVehicle& vehicle, const Vec4<S>& flat) {
  FlatState<S> state;
  const S half(0.5), one(1.0);
  Vec3<S> pull;  // gravity minus acceleration: thrust per mass, downwards
  for (int i = 0; i < 3; ++i) {
    state.p[i] = flat[i];
    state.v[i] = flat[i].Derivative();
    pull[i] = -state.v[i].Derivative();
  }
  pull[2] = pull[2] + S(vehicle.gravity);
  const S thrust = sqrt(pull[0] * pull[0] + pull[1] * pull[1] + pull[2] * pull[2]);
  const S per_thrust = one / thrust;
  const Vec3<S> z(pull[0] * per_thrust, pull[1] * per_thrust, pull[2] * per_thrust);
  state.cos_tilt = z[2];

  // In the frame rotated by yaw, z is (sin(pitch) cos(roll), -sin(roll), cos(pitch) cos(roll)).
  const S c = cos(half * flat[3]), s = sin(half * flat[3]);
  const S cos_yaw = c * c - s * s, sin_yaw = (c + c) * s;
  const S sin_roll = sin_yaw * z[0] - cos_yaw * z[1];
  const S cos_roll = sqrt(one - sin_roll * sin_roll);
  const S sin_pitch = (cos_yaw * z[0] + sin_yaw * z[1]) / cos_roll;
  const S cos_pitch = z[2] / cos_roll;
  const S cx = sqrt(half * (one + cos_roll)), sx = half * sin_roll / cx;
  const S cy = sqrt(half * (one + cos_pitch)), sy = half * sin_pitch / cy;
  const Vec4<S> pitch_roll(cy * cx, cy * sx, sy * cx, -(sy * sx));
  state.q = Vec4<S>(c * pitch_roll[0] - s * pitch_roll[3], c * pitch_roll[1] - s * pitch_roll[2],
                    c * pitch_roll[2] + s * pitch_roll[1], c * pitch_roll[3] + s * pitch_roll[0]);

  const Vec4<S> dq(state.q[0].Derivative(), state.q[1].Derivative(), state.q[2].Derivative(),
                   state.q[3].Derivative());
  const Vec4<S> half_w = HamiltonProduct(Conjugate(state.q), dq);
  for (int i = 0; i < 3; ++i) state.w[i] = half_w[i + 1] + half_w[i + 1];

  Vec3<S> momentum;
  for (int i = 0; i < 3; ++i) momentum[i] = S(vehicle.inertia[i]) * state.w[i];
  const Vec3<S> gyroscopic = Cross(state.w, momentum);
  Vec4<S> wrench;
  wrench[0] = S(vehicle.mass) * thrust;
  for (int i = 0; i < 3; ++i) wrench[i + 1] = momentum[i].Derivative() + gyroscopic[i];
  for (Eigen::Index r = 0; r < vehicle.speeds_from_wrench.rows(); ++r) {
    S sum = S(vehicle.speeds_from_wrench(r, 0)) * wrench[0];
    for (int i = 1; i < 4; ++i) sum = sum + S(vehicle.speeds_from_wrench(r, i)) * wrench[i];
    state.u.push_back(sum);
  }
  return state;
}

// Series from Taylor coefficients, 4 x (order + 1).
template <class S>
Vec4<S> FlatSeries(const Eigen::Matrix<double, 4, Eigen::Dynamic>& expansion) {
  Vec4<S> flat;
  for (int i = 0; i < 4; ++i) {
    flat[i] = S::Start(typename S::Coefficient(expansion(i, 0)));
    for (Eigen::Index j = 1; j < expansion.cols(); ++j) {
      flat[i].Append(typename S::Coefficient(expansion(i, j)));
    }
  }
  return flat;
}

// State and input series at the start of one stretch of time.
template <class C, int kOrder>
struct SegmentStart {
  std::vector<C> x;
  std::vector<Taylor<C, kOrder>> u;
};

// `flat`: series known to order kOrder + 4; `parameters`: the model's kStates numbers.
template <class C, int kOrder>
SegmentStart<C, kOrder> StartFromFlat(const FlatVehicle& vehicle,
                                      const std::vector<double>& parameters,
                                      const Vec4<Taylor<C, kOrder + 4>>& flat) {
  const auto state = StateFromFlat(vehicle, flat);
  SegmentStart<C, kOrder> start;
  start.x.reserve(RotorDrivenModel::kStates);
  for (const double value : parameters) start.x.push_back(C(value));
  for (int i = 0; i < 4; ++i) start.x[RotorDrivenModel::kAttitude + i] = state.q[i][0];
  for (int i = 0; i < 3; ++i) {
    start.x[RotorDrivenModel::kPosition + i] = state.p[i][0];
    start.x[RotorDrivenModel::kVelocity + i] = state.v[i][0];
    start.x[RotorDrivenModel::kRate + i] = state.w[i][0];
  }
  for (const auto& series : state.u) {
    auto u = Taylor<C, kOrder>::Start(series[0]);
    for (int j = 1; j <= kOrder; ++j) u.Append(series[j]);
    start.u.push_back(u);
  }
  return start;
}

class RotorFlight {
 public:
  RotorFlight(const RotorVehicle& vehicle, PiecewisePolynomial path)
      : vehicle_(MakeFlatVehicle(vehicle.model, vehicle.parameters)),
        parameters_(vehicle.parameters),
        path_(std::move(path)) {}

  const FlatVehicle& vehicle() const { return vehicle_; }
  const std::vector<double>& parameters() const { return parameters_; }
  const PiecewisePolynomial& path() const { return path_; }

  NominalPoint At(double t) const {
    const auto flat = FlatSeries<Taylor<double, 4>>(path_.Expand(t, 4));
    const auto start = StartFromFlat<double, 0>(vehicle_, parameters_, flat);
    NominalPoint point{start.x, {}};
    for (const auto& u : start.u) point.u.push_back(u[0]);
    return point;
  }

  NominalFlight Nominal() const {
    return {path_.start(), path_.end(), [this](double t) { return At(t); }};
  }

 private:
  FlatVehicle vehicle_;
  std::vector<double> parameters_;
  PiecewisePolynomial path_;
};

}  // namespace trueline
