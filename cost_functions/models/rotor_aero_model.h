// The rotor-driven model as estimators use it: that of Boehm et al. 2020 with what real flights add
// (linear drag, inflow of the rotors, a late pose sensor) as further constants, zero by default,
// and with the disturbances that make it a stochastic model.
#pragma once

#include <utility>
#include <vector>

#include "cost_functions/models/rotor_driven_model.h"

namespace trueline {

class RotorAeroModel {
 public:
  using Base = RotorDrivenModel;
  enum Index : int {
    kDrag = Base::kStates,  // K_x, K_y, K_z of f_B = diag(K) v_B [1/s]
    kInflow = kDrag + 3,    // k of f_B,z = -k sum(omega) v_B,z [1]
    kPoseDelay,             // a pose stamped t was measured at t - delay [s]
    kStates
  };
  static constexpr int kMoving = Base::kMoving;
  static constexpr int kConstants = kStates - kMoving;
  // Error state: attitude in body axes, q = q0 (1, theta / 2), then one number for each state.
  static constexpr int kMovingErrors = kMoving - 1;
  static constexpr int kErrors = kStates - 1;

  RotorAeroModel(std::vector<RotorSpec> rotors, double gravity)
      : base_(std::move(rotors), gravity) {}

  const Base& base() const { return base_; }
  int num_rotors() const { return base_.num_rotors(); }

  // dx/dt of the first kMoving states. `speeds`: of the rotors [rad/s]. `disturbance`: specific
  // force in body axes [m/s^2], then angular acceleration [rad/s^2]; 6 numbers.
  template <class T>
  void Derivative(const T* x, const double* speeds, const T* disturbance, T* dx) const {
    const std::vector<T> u = Squares<T>(speeds);
    base_.Derivative(x, u.data(), dx);
    const Vec4<T> q(x[0], x[1], x[2], x[3]);
    const Vec3<T> push = RotateByUnit(q, Vec3<T>(AirForce(x, speeds) + Part(disturbance, 0)));
    for (int i = 0; i < 3; ++i) dx[Base::kVelocity + i] += push[i];
    for (int i = 0; i < 3; ++i) dx[Base::kRate + i] += disturbance[3 + i];
  }

  // Accelerometer [m/s^2] then gyro [rad/s]: 6 numbers.
  template <class T>
  void Imu(const T* x, const double* speeds, T* y) const {
    const std::vector<T> u = Squares<T>(speeds);
    base_.Imu(x, u.data(), y);
    const Vec3<T> air = AirForce(x, speeds);
    for (int i = 0; i < 3; ++i) y[i] += air[i];
  }

  // Position of P in E [m] as stamped.
  template <class T>
  static void Position(const T* x, T* y) {
    Base::Position(x, y);
    for (int i = 0; i < 3; ++i) y[i] -= x[kPoseDelay] * x[Base::kVelocity + i];
  }

  // Attitude as stamped: q_E_M, w x y z, turned back over the delay (first order in the delay).
  template <class T>
  static Vec4<T> Attitude(const T* x) {
    const Vec4<T> q(x[0], x[1], x[2], x[3]);
    const T half = T(-0.5) * x[kPoseDelay];
    const Vec3<T> w = Base::Vector(x, Base::kRate);
    return q + TimesPure(q, Vec3<T>(half * w[0], half * w[1], half * w[2]));
  }

 private:
  template <class T>
  static Vec3<T> Part(const T* v, int index) {
    return Vec3<T>(v[index], v[index + 1], v[index + 2]);
  }
  template <class T>
  std::vector<T> Squares(const double* speeds) const {
    std::vector<T> u;
    u.reserve(num_rotors());
    for (int i = 0; i < num_rotors(); ++i) u.emplace_back(speeds[i] * speeds[i]);
    return u;
  }
  // Specific force of the air on body and rotors beyond thrust, in body axes.
  template <class T>
  Vec3<T> AirForce(const T* x, const double* speeds) const {
    const Vec4<T> back = Conjugate(Vec4<T>(x[0], x[1], x[2], x[3]));
    const Vec3<T> v_B = RotateByUnit(back, Base::Vector(x, Base::kVelocity));
    double sum = 0.0;
    for (int i = 0; i < num_rotors(); ++i) sum += speeds[i];
    return Vec3<T>(x[kDrag] * v_B[0], x[kDrag + 1] * v_B[1],
                   (x[kDrag + 2] - T(sum) * x[kInflow]) * v_B[2]);
  }

  Base base_;
};

}  // namespace trueline
