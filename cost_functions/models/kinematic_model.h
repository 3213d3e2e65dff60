// The kinematic model of Li et al. 2019, eq. 37: position, velocity and attitude driven by the
// accelerometer and the gyroscope alone, without any model of the vehicle.
//
//   dp/dt = v,  dv/dt = g + R_E_I (a_m - b_a),  attitude turned by w_m - b_g
//
// Sign: eq. 20 and 37 add the biases; this project subtracts them everywhere (measured = true +
// bias, as in eq. 15), so that b_az means the same in every estimator.
#pragma once

#include "cost_functions/models/rotation.h"

namespace trueline {

// The IMU's readings at the middle of a step, in I. Plain numbers of the log, never differentiated.
struct ImuInput {
  Eigen::Vector3d accel;  // m/s^2, specific force
  Eigen::Vector3d gyro;   // rad/s
};

template <typename T>
struct ImuBias {
  Vector3<T> accel = Vector3<T>::Zero();  // m/s^2
  Vector3<T> gyro = Vector3<T>::Zero();   // rad/s
};

// Names and units of the biases, accel first.
inline constexpr const char* kImuBiasNames[] = {"b_ax", "b_ay", "b_az", "b_gx", "b_gy", "b_gz"};
inline constexpr const char* kImuBiasUnits[] = {"m/s^2", "m/s^2", "m/s^2",
                                                "rad/s", "rad/s", "rad/s"};
inline constexpr int kImuBiasSize = 6;

// Attitude as a quaternion; no singular attitude.
template <typename T>
struct KinematicState {
  Vector3<T> p = Vector3<T>::Zero();  // m, in E
  Vector3<T> v = Vector3<T>::Zero();  // m/s, in E
  Eigen::Quaternion<T> q_E_I = Eigen::Quaternion<T>(T(1), T(0), T(0), T(0));
};

// Attitude as the paper's Euler angles Phi_E_I; singular at theta = +-pi/2.
template <typename T>
struct EulerKinematicState {
  Vector3<T> p = Vector3<T>::Zero();    // m, in E
  Vector3<T> v = Vector3<T>::Zero();    // m/s, in E
  Vector3<T> Phi = Vector3<T>::Zero();  // rad
};

// Quaternion of the rotation vector 2 * half (rad). Polynomials in |half|^2 without a branch, so
// derivatives are correct at zero; the error is below 1e-11 up to |half| = 0.15 rad.
template <typename T>
Eigen::Quaternion<T> RotationFromHalfVector(const Vector3<T>& half) {
  const T s = half.squaredNorm();
  const T cosine = T(1) - s * (T(1.0 / 2) - s * (T(1.0 / 24) - s * T(1.0 / 720)));
  const T sinc = T(1) - s * (T(1.0 / 6) - s * (T(1.0 / 120) - s * T(1.0 / 5040)));
  return Eigen::Quaternion<T>(cosine, sinc * half[0], sinc * half[1], sinc * half[2]);
}

template <typename T>
Vector3<T> DownwardGravity(double gravity) {
  return Vector3<T>(T(0), T(0), T(gravity));
}

namespace internal {

// p and v over dt seconds of constant acceleration.
template <typename T, typename State>
void MoveWith(const Vector3<T>& a_E, double dt, State* x) {
  x->p += (x->v + a_E * T(0.5 * dt)) * T(dt);
  x->v += a_E * T(dt);
}

}  // namespace internal

// One midpoint step of dt seconds (second order). The quaternion keeps its norm to 1e-11 for each
// step; callers that take many steps must normalise it.
template <typename T>
void KinematicStep(const ImuInput& imu, const ImuBias<T>& bias, double gravity, double dt,
                   KinematicState<T>* x) {
  const Vector3<T> rate = imu.gyro.cast<T>() - bias.gyro;
  const Eigen::Quaternion<T> half_turn = RotationFromHalfVector<T>(rate * T(0.25 * dt));
  const Eigen::Quaternion<T> q_mid = x->q_E_I * half_turn;
  const Vector3<T> force = imu.accel.cast<T>() - bias.accel;
  internal::MoveWith<T>(q_mid * force + DownwardGravity<T>(gravity), dt, x);
  x->q_E_I = q_mid * half_turn;
}

// The same step on Euler angles (eq. 20 with the opposite sign of the biases).
template <typename T>
void KinematicStep(const ImuInput& imu, const ImuBias<T>& bias, double gravity, double dt,
                   EulerKinematicState<T>* x) {
  const Vector3<T> rate = imu.gyro.cast<T>() - bias.gyro;
  const Vector3<T> Phi_mid = x->Phi + EulerRateFromBodyRate<T>(x->Phi) * rate * T(0.5 * dt);
  const Vector3<T> force = imu.accel.cast<T>() - bias.accel;
  const Vector3<T> force_E = RotationFromEuler<T>(Phi_mid).transpose() * force;
  internal::MoveWith<T>(force_E + DownwardGravity<T>(gravity), dt, x);
  x->Phi += EulerRateFromBodyRate<T>(Phi_mid) * rate * T(dt);
}

// Preintegrated motion of the kinematic model (eq. 37 of Li et al. 2019) over a short block.
//
// Expressed in the IMU frame at the block's start, the motion is independent of the initial state.
// The accelerometer's bias enters linearly. The gyroscope's bias turns the block by bias * h; its
// first order is kept, and its product with the accelerometer's bias in velocity. With 30 ms and 6
// deg/s the neglected terms are below 1e-5 rad and 1e-4 m/s for each block.
struct KinematicBlock {
  double h = 0.0;                                            // s, length
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  // I at the end to I at the start
  Eigen::Vector3d v = Eigen::Vector3d::Zero();               // m/s, gained without gravity
  Eigen::Vector3d p = Eigen::Vector3d::Zero();               // m, the same
  Eigen::Matrix3d d_turn_bg = Eigen::Matrix3d::Zero();       // s, rotation vector at the end
  Eigen::Matrix3d d_v_bg = Eigen::Matrix3d::Zero();          // m
  Eigen::Matrix3d d_p_bg = Eigen::Matrix3d::Zero();          // m s
  Eigen::Matrix3d d_v_ba = Eigen::Matrix3d::Zero();          // s, minus the integral of R
  Eigen::Matrix3d d_p_ba = Eigen::Matrix3d::Zero();          // s^2
  Eigen::Matrix3d R_tau_dt = Eigen::Matrix3d::Zero();        // s^2, integral of tau R
};

// Moves `x` over one block; any scalar.
template <typename T>
void Propagate(const KinematicBlock& m, const ImuBias<T>& bias, double gravity,
               KinematicState<T>* x) {
  const Vector3<T> g = DownwardGravity<T>(gravity);
  const Vector3<T> v_I = m.v.cast<T>() + m.d_v_ba.cast<T>() * bias.accel +
                         m.d_v_bg.cast<T>() * bias.gyro +
                         m.R_tau_dt.cast<T>() * bias.gyro.cross(bias.accel);
  const Vector3<T> p_I =
      m.p.cast<T>() + m.d_p_ba.cast<T>() * bias.accel + m.d_p_bg.cast<T>() * bias.gyro;
  x->p += (x->v + g * T(0.5 * m.h)) * T(m.h) + x->q_E_I * p_I;
  x->v += g * T(m.h) + x->q_E_I * v_I;
  const Vector3<T> half = m.d_turn_bg.cast<T>() * bias.gyro * T(0.5);
  x->q_E_I = x->q_E_I * (m.turn.cast<T>() * RotationFromHalfVector<T>(half));
}

}  // namespace trueline
