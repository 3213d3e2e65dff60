// Rigid body driven by rotor speeds (Wuest et al. 2019; Boehm et al. 2020, sec. II), in NED earth
// axes E and forward-right-down body axes. B is the frame of the vehicle's description, M the
// centre of mass with the same axes, I the IMU, P the pose sensor (or GNSS antenna). The papers use
// z-up axes: gravity then enters vdot with a minus sign.
#pragma once

#include <vector>

#include "cost_functions/models/rigid_body.h"

namespace trueline {

class RotorDrivenModel {
 public:
  // State x: moving states first (kMoving numbers), then constants. The papers' 31 numbers, and
  // three that they assume known: r_BI_z and the scales of k_f and k_m (1 is nominal).
  enum Index : int {
    kAttitude = 0,  // q_E_M, w x y z
    kPosition = 4,  // p_E_M [m]
    kVelocity = 7,  // v_E [m/s]
    kRate = 10,     // w_M [rad/s], in body axes
    kMoving = 13,
    kMass = 13,       // kg
    kInertia = 14,    // diagonal, about M [kg m^2]
    kCentre = 17,     // r_BM [m]
    kPoseArm = 20,    // r_BP [m]
    kImuArm = 23,     // r_BI [m]
    kAccelBias = 26,  // m/s^2
    kGyroBias = 29,   // rad/s
    kThrustScale = 32,
    kTorqueScale = 33,
    kStates = 34
  };

  explicit RotorDrivenModel(std::vector<Rotor> rotors, double gravity = 9.81)
      : rotors_(std::move(rotors)), gravity_(gravity) {}

  int num_rotors() const { return static_cast<int>(rotors_.size()); }
  const std::vector<Rotor>& rotors() const { return rotors_; }
  double gravity() const { return gravity_; }

  template <class T>
  static Vec3<T> Vector(const T* x, int index) {
    return Vec3<T>(x[index], x[index + 1], x[index + 2]);
  }

  template <class T>
  struct Wrench {
    Vec3<T> force;   // N, in body axes
    Vec3<T> moment;  // N m, about M
  };

  // Sums over all rotors, with nominal k_f and k_m.
  template <class T>
  struct RotorSums {
    Vec3<T> force;     // N, sum k_f u_i n_i
    Vec3<T> lever;     // N m, about the origin of B: sum t_i x k_f u_i n_i
    Vec3<T> reaction;  // N m, sum k_m,i u_i n_i
  };

  // M = lever - r_BM x F + reaction, with the scales of k_f and k_m.
  template <class T>
  static Wrench<T> WrenchOf(const T* x, const RotorSums<T>& sums) {
    const Vec3<T> force = Scaled(x[kThrustScale], sums.force);
    const Vec3<T> lever = Scaled(x[kThrustScale], sums.lever);
    return {force,
            lever + Scaled(x[kTorqueScale], sums.reaction) - Cross(Vector(x, kCentre), force)};
  }

  template <class T>
  RotorSums<T> SumsOf(const T* u) const {
    Vec3<T> force(T(0.0), T(0.0), T(0.0)), lever = force, reaction = force;
    for (int i = 0; i < num_rotors(); ++i) {
      const Rotor& rotor = rotors_[i];
      const T thrust = T(rotor.k_f) * u[i];
      AddScaled(rotor.axis, thrust, &force);
      for (int a = 0; a < 3; ++a) {  // position x axis, in T so that it is exact where T is
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        AddProduct(rotor.position[b], rotor.axis[c], thrust, &lever[a]);
        AddProduct(rotor.position[c], -rotor.axis[b], thrust, &lever[a]);
      }
      AddScaled(rotor.axis, T(rotor.spin * rotor.k_m) * u[i], &reaction);
    }
    return {force, lever, reaction};
  }
  template <class T>
  Wrench<T> ForceAndMoment(const T* x, const T* u) const {
    return WrenchOf(x, SumsOf(u));
  }

  // dw/dt [rad/s^2] from I dw/dt = M - w x I w.
  template <class T>
  static Vec3<T> AngularAcceleration(const T* x, const Vec3<T>& moment) {
    const Vec3<T> w = Vector(x, kRate);
    const Vec3<T> torque = moment - Cross(w, ScaledBy(x + kInertia, w));
    return Vec3<T>(torque[0] / x[kInertia], torque[1] / x[kInertia + 1],
                   torque[2] / x[kInertia + 2]);
  }

  // dx/dt of the first kMoving states; u holds the squared rotor speeds [rad^2/s^2].
  template <class T>
  void Derivative(const T* x, const T* u, T* dx) const {
    DerivativeBy(x, ForceAndMoment(x, u), dx);
  }
  template <class T>
  void DerivativeBy(const T* x, const Wrench<T>& wrench, T* dx) const {
    Move(x, SpecificForce(x, wrench), AngularAcceleration(x, wrench.moment), dx);
  }

  // The same from specific force [m/s^2] and angular acceleration [rad/s^2] in body axes.
  template <class T>
  void Move(const T* x, const Vec3<T>& force, const Vec3<T>& dw, T* dx) const {
    const Vec4<T> q(x[0], x[1], x[2], x[3]);
    const Vec4<T> twice_dq = TimesPure(q, Vector(x, kRate));
    const Vec3<T> push = RotateByUnit(q, force);
    const T half(0.5);
    for (int i = 0; i < 4; ++i) dx[kAttitude + i] = half * twice_dq[i];
    for (int i = 0; i < 3; ++i) {
      dx[kPosition + i] = x[kVelocity + i];
      dx[kVelocity + i] = push[i];
      dx[kRate + i] = dw[i];
    }
    dx[kVelocity + 2] = dx[kVelocity + 2] + T(gravity_);
  }

  // Accelerometer [m/s^2] then gyro [rad/s]: 6 numbers.
  template <class T>
  void Imu(const T* x, const T* u, T* y) const {
    ImuBy(x, ForceAndMoment(x, u), y);
  }
  template <class T>
  static void ImuBy(const T* x, const Wrench<T>& wrench, T* y) {
    Read(x, SpecificForce(x, wrench), AngularAcceleration(x, wrench.moment), y);
  }

  // The same from specific force and angular acceleration.
  template <class T>
  static void Read(const T* x, const Vec3<T>& force, const Vec3<T>& dw, T* y) {
    const Vec3<T> w = Vector(x, kRate);
    const Vec3<T> arm = Vector(x, kImuArm) - Vector(x, kCentre);
    const Vec3<T> accel = force + Cross(dw, arm) + Cross(w, Cross(w, arm));
    for (int i = 0; i < 3; ++i) y[i] = accel[i] + x[kAccelBias + i];
    for (int i = 0; i < 3; ++i) y[3 + i] = w[i] + x[kGyroBias + i];
  }

  // Position of P in E [m]: 3 numbers.
  template <class T>
  static void Position(const T* x, T* y) {
    const Vec4<T> q(x[0], x[1], x[2], x[3]);
    const Vec3<T> arm = RotateByUnit(q, Vec3<T>(Vector(x, kPoseArm) - Vector(x, kCentre)));
    for (int i = 0; i < 3; ++i) y[i] = x[kPosition + i] + arm[i];
  }

  // Attitude q_E_P = q_E_M (the sensor's axes are the body's): 4 numbers.
  template <class T>
  static void Attitude(const T* x, T* y) {
    for (int i = 0; i < 4; ++i) y[i] = x[kAttitude + i];
  }

 private:
  template <class T>
  static Vec3<T> SpecificForce(const T* x, const Wrench<T>& wrench) {
    const T per_mass = T(1.0) / x[kMass];
    return Scaled(per_mass, wrench.force);
  }
  template <class T>
  static void AddScaled(const Eigen::Vector3d& direction, const T& factor, Vec3<T>* sum) {
    for (int i = 0; i < 3; ++i) AddProduct(direction[i], 1.0, factor, &(*sum)[i]);
  }
  // *sum += a b factor; skipped for zeros, of which a vehicle's geometry has many.
  template <class T>
  static void AddProduct(double a, double b, const T& factor, T* sum) {
    if (a == 0.0 || b == 0.0) return;
    const T scale = b == 1.0 ? T(a) : b == -1.0 ? T(-a) : T(a) * T(b);
    *sum = *sum + scale * factor;
  }

  std::vector<Rotor> rotors_;
  double gravity_;
};

}  // namespace trueline
