// Preintegrated motion of the IMU-driven model (Li et al. 2019, eq. 15) over a short block.
//
// Seen from the AHRS's earth E' the velocity obeys
//   dv/dt = g' + R (w (a_z - b_az) + D R' v),
// with R = R_Ep_I(t) logged, w = R_I_B e_z, D = R_I_B diag(K_x, K_y, 0) R_B_I where a_z is along
// z_B. Where it is along z_I, w is divided by its z and D is without its third row: drag does not
// change what was measured. The parameters are factors outside of all integrals over the log. The
// log enters by moments that are summed once, at the IMU's own rate, and are valid for every
// parameter value; nothing is linearised. The only approximation is in drag: within a block its
// velocity is a straight line with the right mean. Tests limit the error to 1 mm after 10 s with
// blocks of 50 ms.
#pragma once

#include "cost_functions/models/force_effects.h"
#include "cost_functions/models/imu_driven_model.h"

namespace trueline {

// The moving part of the IMU-driven model.
template <typename T>
struct MotionState {
  Vector3<T> p = Vector3<T>::Zero();  // m
  Vector3<T> v = Vector3<T>::Zero();  // m/s
};

// Symmetric 3 x 3 matrices as (xx, yy, zz, xy, xz, yz).
template <typename T>
using Symmetric3 = Eigen::Matrix<T, 6, 1>;

template <typename T>
Matrix3<T> Unpack(const Symmetric3<T>& s) {
  Matrix3<T> m;
  m << s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2];
  return m;
}

// The linear map from packed D to packed R D R'.
inline Eigen::Matrix<double, 6, 6> CongruenceMap(const Eigen::Matrix3d& R) {
  constexpr int kI[6] = {0, 1, 2, 0, 0, 1}, kJ[6] = {0, 1, 2, 1, 2, 2};
  Eigen::Matrix<double, 6, 6> map;
  for (int row = 0; row < 6; ++row) {
    const int i = kI[row], j = kJ[row];
    for (int col = 0; col < 3; ++col) map(row, col) = R(i, col) * R(j, col);
    for (int col = 3; col < 6; ++col) {
      const int k = kI[col], l = kJ[col];
      map(row, col) = R(i, k) * R(j, l) + R(i, l) * R(j, k);
    }
  }
  return map;
}

// Moments of the drive over a block, with tau the time since its start.
struct MotionBlock {
  double h = 0.0;                                       // s, length
  double t = 0.0;                                       // s, start, from the log's
  double a_dt = 0.0;                                    // int a_z dtau
  Eigen::Matrix3d R_dt = Eigen::Matrix3d::Zero();       // int R dtau
  Eigen::Matrix3d Ra_dt = Eigen::Matrix3d::Zero();      // int R a_z dtau
  Eigen::Matrix3d R_tau_dt = Eigen::Matrix3d::Zero();   // int tau R dtau
  Eigen::Matrix3d Ra_tau_dt = Eigen::Matrix3d::Zero();  // int tau R a_z dtau
  Eigen::Matrix<double, 6, 6> RR_dt = Eigen::Matrix<double, 6, 6>::Zero();      // int R (x) R dtau
  Eigen::Matrix<double, 6, 6> RR_tau_dt = Eigen::Matrix<double, 6, 6>::Zero();  // int tau R (x) R

  // Appends `dt` seconds of constant drive (its value at the middle: second order).
  void Append(const Drive& drive, double dt) {
    const double tau_mid = h + 0.5 * dt;
    const Eigen::Matrix<double, 6, 6> RR = CongruenceMap(drive.R_Ep_I);
    a_dt += drive.a_z * dt;
    R_dt += drive.R_Ep_I * dt;
    Ra_dt += drive.R_Ep_I * (drive.a_z * dt);
    R_tau_dt += drive.R_Ep_I * (tau_mid * dt);
    Ra_tau_dt += drive.R_Ep_I * (drive.a_z * tau_mid * dt);
    RR_dt += RR * dt;
    RR_tau_dt += RR * (tau_mid * dt);
    h += dt;
  }
};

// Products of the log's plain numbers with any scalar (cheaper than casting the numbers to Jets).
template <typename T, int kRows, int kCols>
Eigen::Matrix<T, kRows, 1> Times(const Eigen::Matrix<double, kRows, kCols>& m,
                                 const Eigen::Matrix<T, kCols, 1>& x) {
  Eigen::Matrix<T, kRows, 1> y;
  for (int i = 0; i < kRows; ++i) {
    y[i] = x[0] * m(i, 0);
    for (int j = 1; j < kCols; ++j) y[i] += x[j] * m(i, j);
  }
  return y;
}

// The model in the blocks' form, seen from E'; computed once for each evaluation.
template <typename T>
struct BlockModel {
  Matrix3<T> R_Ep_E;
  Vector3<T> g_Ep;     // gravity in E'
  Vector3<T> w;        // acceleration in I for each unit of a_z
  Vector3<T> w_b;      // w * b_az
  Symmetric3<T> drag;  // the symmetric part of D, packed, in I
  Vector3<T> turn;     // the rest of D is the cross product with this
  Matrix3<T> R_B_I;
  T share_x = T(0), share_y = T(0);         // of the force along x_B and y_B, what a_z holds
  T K_x, K_y, b_az;                         // 1/s, 1/s, m/s^2
  Vector3<T> start_E = Vector3<T>::Zero();  // m, where the chain starts; for forces at a place
  const ForceEffects* effects = nullptr;    // force beyond linear drag; null: none

  explicit BlockModel(const ImuDrivenModel<T>& model, const ForceEffects* force_effects = nullptr)
      : R_Ep_E(model.R_Ep_E()), R_B_I(model.R_B_I()) {
    const ImuDrivenParameters<T>& p = model.parameters();
    K_x = p.K_x;
    K_y = p.K_y;
    b_az = p.b_az;
    if (force_effects != nullptr && force_effects->Any()) effects = force_effects;
    g_Ep = R_Ep_E.col(2) * model.g_E()[2];
    w = R_B_I.row(2).transpose();
    if (model.axis() == ThrustAxis::kImu) {
      share_x = R_B_I(0, 2) / w[2];
      share_y = R_B_I(1, 2) / w[2];
    }
    // D = K_x (x - share_x z) x' + K_y (y - share_y z) y', for x, y, z the body's axes in I.
    const Vector3<T> x = R_B_I.row(0).transpose(), y = R_B_I.row(1).transpose();
    const Vector3<T> by_x = (x - w * share_x) * K_x, by_y = (y - w * share_y) * K_y;
    const auto entry = [&](int i, int j) -> T {
      return (by_x[i] * x[j] + by_x[j] * x[i] + by_y[i] * y[j] + by_y[j] * y[i]) * T(0.5);
    };
    drag << entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2);
    turn = (y * (K_x * share_x) - x * (K_y * share_y)) * T(0.5);
    if (model.axis() == ThrustAxis::kImu) w /= T(w[2]);
    w_b = w * p.b_az;
  }

  // Int R D R' over a block, from the integrals of R (x) R and of R.
  Matrix3<T> DragOver(const Eigen::Matrix<double, 6, 6>& RR, const Eigen::Matrix3d& R) const {
    return Unpack<T>(Times(RR, drag)) + Skew<T>(Times(R, turn));
  }
};

// The acceleration of one block without effects, and how it changes (p, v) in E'.
template <typename T>
struct BlockMotion {
  Matrix3<T> A, A_tau;    // int R D R' dtau, int tau R D R' dtau
  Vector3<T> free_curve;  // m/s, mean of the velocity's curve by gravity and thrust
  Vector3<T> first_a, a;  // m/s^2, mean acceleration: without and with A_tau
  Vector3<T> dv, dp;
};

// Nearly all time of an evaluation is spent here. Without `flatten` compilers make a function call
// of each sum and product of Jets. Under the sanitizers it is off: with a check on every access the
// compilation would take half an hour.
#ifdef __SANITIZE_ADDRESS__
#define TRUELINE_FLATTEN
#else
#define TRUELINE_FLATTEN [[gnu::flatten]]
#endif
template <typename T>
TRUELINE_FLATTEN BlockMotion<T> MotionOver(const BlockModel<T>& b, const MotionBlock& m,
                                           const Vector3<T>& v) {
  BlockMotion<T> x;
  const T h(m.h);
  // Velocity and position gained from gravity and thrust, without drag.
  const Vector3<T> dv_free = b.g_Ep * h + Times(m.Ra_dt, b.w) - Times(m.R_dt, b.w_b);
  const Vector3<T> dv_tau = b.g_Ep * T(0.5 * m.h * m.h) + Times(m.Ra_tau_dt, b.w) -
                            Times(m.R_tau_dt, b.w_b);  // int tau dv
  // Drag acts on the velocity v + a * tau + curve within the block; the curve's mean comes from the
  // free motion and from drag itself; all terms up to h^3.
  x.A = b.DragOver(m.RR_dt, m.R_dt);
  x.A_tau = b.DragOver(m.RR_tau_dt, m.R_tau_dt);
  x.free_curve = dv_free * T(0.5) - dv_tau * T(1.0 / m.h);
  x.first_a = (dv_free + x.A * (v + x.free_curve)) * T(1.0 / m.h);
  const Vector3<T> curve = x.free_curve - x.A * x.first_a * T(m.h / 12.0);
  x.a = x.first_a + x.A_tau * x.first_a * T(1.0 / m.h);
  x.dv = dv_free + x.A * (v + curve) + x.A_tau * x.a;
  const Vector3<T> dv_tau_drag = x.A_tau * v + x.A * (x.a * T(m.h / 3.0) + curve * T(0.5)) * h;
  // p changes by v h + int (h - tau) dv.
  x.dp = v * h + (x.dv * h - dv_tau - dv_tau_drag);
  return x;
}
#undef TRUELINE_FLATTEN

// Acceleration in E' (m/s^2) that the effects add to a block in which the velocity is v_Ep on
// average, p_Ep from the chain's start; attitude and thrust are the block's means.
template <typename T>
Vector3<T> AddedAcceleration(const BlockModel<T>& b, const MotionBlock& m, const Vector3<T>& v_Ep,
                             const Vector3<T>& p_Ep) {
  const Eigen::Matrix3d R_I_Ep = m.R_dt.transpose() / m.h;
  const Vector3<T> ground_B = b.R_B_I * Times(R_I_Ep, v_Ep);
  const Vector3<T> wind_Ep = b.R_Ep_E * b.effects->wind_E.template cast<T>();
  const Vector3<T> wind_B = b.R_B_I * Times(R_I_Ep, wind_Ep);
  const double thrust = -m.a_dt / m.h, t = m.t + 0.5 * m.h;
  Vector3<T> f_B = b.effects->AddedForce(b.K_x, b.K_y, ground_B, wind_B, thrust, t);
  if (!b.effects->terms.empty()) {
    const Matrix3<T> R_E_Ep = b.R_Ep_E.transpose();
    const Matrix3<T> R_Ep_B = R_I_Ep.transpose().template cast<T>() * b.R_B_I.transpose();
    f_B +=
        b.effects->TermForce(b.R_B_I, TermState<T>{ground_B, Vector3<T>::Zero(), T(thrust),
                                                   R_E_Ep * R_Ep_B, b.start_E + R_E_Ep * p_Ep, t});
  }
  f_B[2] -= b.share_x * f_B[0] + b.share_y * f_B[1];
  const Vector3<T> f_I = b.R_B_I.transpose() * f_B;
  return Times(Eigen::Matrix3d(R_I_Ep.transpose()), f_I);
}

// Velocity that the effects add over a block, from the block's mean velocity without them. Two
// iterations, so that all drag acts on the velocity that the effects themselves change.
template <typename T>
Vector3<T> AddedVelocity(const BlockModel<T>& b, const MotionBlock& m, const Matrix3<T>& A,
                         const Vector3<T>& v_mean, const Vector3<T>& p_Ep) {
  const Vector3<T> p_mean = p_Ep + v_mean * T(0.5 * m.h);
  const Vector3<T> half = AddedAcceleration(b, m, v_mean, p_mean) * T(0.5 * m.h);
  return AddedAcceleration<T>(b, m, v_mean + half, p_mean) * T(m.h) + A * half;
}

// Moves (p, v), both in E', over one block.
template <typename T>
void Propagate(const BlockModel<T>& b, const MotionBlock& m, MotionState<T>* state) {
  BlockMotion<T> x = MotionOver(b, m, state->v);
  if (b.effects != nullptr) {
    const Vector3<T> added = AddedVelocity<T>(b, m, x.A, state->v + x.dv * T(0.5), state->p);
    x.dv += added;
    x.dp += added * T(0.5 * m.h);
  }
  state->p += x.dp;
  state->v += x.dv;
}

}  // namespace trueline
