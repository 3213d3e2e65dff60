// Preintegrated motion of the IMU-driven model (Li et al. 2019, eq. 15) over a short block.
//
// The model's force is affine in what drives it (ForceLaw). Seen from the AHRS's earth E', with
// R = R_Ep_I(t) logged, the velocity obeys
//   dv/dt = g' + R (w a_z + f_0 + D R' v).
// The parameters (in g', w, f_0 and D) are factors outside of all integrals over the log. The log
// enters by moments that are summed once, at the IMU's own rate, and are valid for every parameter
// value; nothing is linearised. A block of length h changes the velocity by dv, and the position by
// u h with the mean velocity u:
//   q  = v + c - E v                         A = int R D R' dtau
//   r  = a h + f + A q                       E = int (tau / h - 1/2) R D R' dtau
//   dv = r + E r + A (r / 2 + A r / 6)       f: gained from w and f_0
//   u  = q + dv / 2 - A dv / 12              c: what the curve of f adds to the mean
// where a holds g' and what else is constant. Drag acts on a velocity that bends as gravity, thrust
// and drag itself bend it; what is left out is of fourth order in h. Tests limit the error to 1 mm
// after 10 s with blocks of 50 ms.
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

// Moments of the drive over a block. The weight of `bend` is tau / h - 1/2: minus a half at the
// start, a half at the end.
struct MotionBlock {
  double t;                                         // s, start, from the log's
  double h;                                         // s, length
  double tau = 0.0;                                 // s, how far it is filled
  double a_dt = 0.0;                                // int a_z dtau
  Eigen::Matrix3d R_dt = Eigen::Matrix3d::Zero();   // int R dtau
  Eigen::Matrix3d Ra_dt = Eigen::Matrix3d::Zero();  // int R a_z dtau
  Eigen::Matrix3d R_bend = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d Ra_bend = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 6, 6> RR_dt = Eigen::Matrix<double, 6, 6>::Zero();  // int R (x) R dtau
  Eigen::Matrix<double, 6, 6> RR_bend = Eigen::Matrix<double, 6, 6>::Zero();

  // Appends `dt` seconds of constant drive (its value at the middle: second order).
  void Append(const Drive& drive, double dt) {
    const double bend = ((tau + 0.5 * dt) / h - 0.5) * dt;
    const Eigen::Matrix<double, 6, 6> RR = CongruenceMap(drive.R_Ep_I);
    a_dt += drive.a_z * dt;
    R_dt += drive.R_Ep_I * dt;
    Ra_dt += drive.R_Ep_I * (drive.a_z * dt);
    R_bend += drive.R_Ep_I * bend;
    Ra_bend += drive.R_Ep_I * (drive.a_z * bend);
    RR_dt += RR * dt;
    RR_bend += RR * bend;
    tau += dt;
  }
};

// The model's specific force in I without effects: w a_z + f_0 + D v_I.
template <typename T>
struct ForceLaw {
  Vector3<T> w, f_0;
  Symmetric3<T> drag;  // the symmetric part of D
  Vector3<T> turn;     // the rest of D is the cross product with this

  explicit ForceLaw(const ImuDrivenModel<T>& model) {
    Matrix3<T> D;
    f_0 = model.ForceInImu(0.0, Vector3<T>::Zero());
    w = model.ForceInImu(1.0, Vector3<T>::Zero()) - f_0;
    for (int k = 0; k < 3; ++k) D.col(k) = model.ForceInImu(0.0, Vector3<T>::Unit(k)) - f_0;
    const Matrix3<T> S = (D + D.transpose()) * 0.5;
    drag << S(0, 0), S(1, 1), S(2, 2), S(0, 1), S(0, 2), S(1, 2);
    turn = Vector3<T>(D(2, 1) - D(1, 2), D(0, 2) - D(2, 0), D(1, 0) - D(0, 1)) * 0.5;
  }
};

// What the law makes of a block's moments.
template <typename T>
struct BlockForces {
  Matrix3<T> A, E;
  Vector3<T> f, c;  // m/s

  TRUELINE_INLINE BlockForces(const ForceLaw<T>& law, const MotionBlock& m)
      : A(Drag(law, m.RR_dt, m.R_dt)),
        E(Drag(law, m.RR_bend, m.R_bend)),
        f(Times(m.Ra_dt, law.w) + Times(m.R_dt, law.f_0)),
        c(-Times(m.Ra_bend, law.w) - Times(m.R_bend, law.f_0)) {}

 private:
  TRUELINE_INLINE static Matrix3<T> Drag(const ForceLaw<T>& law,
                                         const Eigen::Matrix<double, 6, 6>& RR,
                                         const Eigen::Matrix3d& R) {
    return Unpack<T>(Times(RR, law.drag)) + Skew<T>(Times(R, law.turn));
  }
};

// The motion over a block.
template <typename T>
struct BlockMotion {
  Vector3<T> dv, u;  // m/s

  // v: at the start; gained: a h.
  TRUELINE_INLINE BlockMotion(const BlockForces<T>& b, const Vector3<T>& v,
                              const Vector3<T>& gained)
      : dv(Vector3<T>::Zero()), u(v + b.c - Times(b.E, v)) {
    Gain(b, gained + b.f + Times(b.A, u));
  }
  TRUELINE_INLINE void Gain(const BlockForces<T>& b, const Vector3<T>& r) {
    const Vector3<T> r_A = r * 0.5 + Times(b.A, r) * (1.0 / 6.0);
    const Vector3<T> more = r + Times(b.E, r) + Times(b.A, r_A);
    dv += more;
    u += more * 0.5 - Times(b.A, more) * (1.0 / 12.0);
  }
};

// The model in the blocks' form, seen from E'; computed once for each evaluation.
template <typename T>
struct BlockModel {
  ImuDrivenModel<T> model;
  ForceLaw<T> law;
  Vector3<T> g_Ep;                          // gravity in E'
  Vector3<T> start_E = Vector3<T>::Zero();  // m, where the chain starts; for forces at a place
  const ForceEffects* effects = nullptr;    // force beyond linear drag; null: none

  explicit BlockModel(const ImuDrivenModel<T>& equations, const ForceEffects* added = nullptr)
      : model(equations), law(equations), g_Ep(model.R_Ep_E() * model.g_E()) {
    if (added != nullptr && added->Any()) effects = added;
  }

  // m/s, in E': what effects add over a block. They act at its mean attitude, thrust and place and
  // at the mean velocity that they themselves change. p: at its start; u: mean without them.
  Vector3<T> Added(const MotionBlock& m, const Vector3<T>& p, const Vector3<T>& u) const {
    const Eigen::Matrix3d R_Ep_I = m.R_dt / m.h;
    const auto place = [&]() -> Vector3<T> {
      return start_E + model.R_Ep_E().transpose() * (p + u * (0.5 * m.h));
    };
    const auto at = [&](const Vector3<T>& v) -> Vector3<T> {
      return Times(m.R_dt,
                   effects->ForceInImu(model, R_Ep_I, v, place, -m.a_dt / m.h, m.t + 0.5 * m.h));
    };
    return at(u + at(u) * 0.5);
  }
};

// Moves (p, v), both in E', over one block. Nearly all time of an evaluation is spent here; in Jets
// it is as fast as slopes that are written out by hand.
template <typename T>
TRUELINE_FLATTEN void Propagate(const BlockModel<T>& model, const MotionBlock& m,
                                MotionState<T>* state) {
  const BlockForces<T> b(model.law, m);
  BlockMotion<T> x(b, state->v, model.g_Ep * m.h);
  if (model.effects != nullptr) x.Gain(b, model.Added(m, state->p, x.u));
  state->p += x.u * m.h;
  state->v += x.dv;
}

}  // namespace trueline
