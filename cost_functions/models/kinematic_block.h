// Preintegrated motion of the kinematic model (eq. 37 of Li et al. 2019) over a short block.
//
// Expressed in the IMU frame at the block's start, the motion is independent of the initial state.
// The accelerometer's bias enters linearly. The gyroscope's bias turns the block by bias * h; its
// first order is kept, and its product with the accelerometer's bias in velocity. With 30 ms and 6
// deg/s the neglected terms are below 1e-5 rad and 1e-4 m/s for each block.
#pragma once

#include "cost_functions/models/kinematic_model.h"

namespace trueline {

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
