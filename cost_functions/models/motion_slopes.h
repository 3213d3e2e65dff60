// Derivatives of preintegrated motion (motion_block.h).
//
// With A = int R D R' dtau, A_tau = int tau R D R' dtau, and f and s the velocity gained from
// gravity and thrust and its first moment, a block of length h changes velocity and position by
//   h a1 = f + A (v + c),  c = f / 2 - s / h
//   dv   = V a1,                              V = h I + A_tau + A_tau^2 / h - h / 12 A^2
//   dp   = v h + Q a1 - s - A_tau v - h / 2 A c,
//                                             Q = h V - h^2 / 3 A - h / 3 A A_tau + h^2 / 24 A^2
// for a1 the mean acceleration before the correction by A_tau. The parameters enter by D, the
// thrust axis w, the bias b_az and gravity g' alone. Derivatives by these are carried along the
// chain: two 3 x 3 matrices carry all columns over a block, and the block adds its own share,
// without differentiating any rotation. At the nodes they become derivatives by the parameters.
#pragma once

#include <ceres/jet.h>

#include <array>

#include "cost_functions/models/motion_block.h"

namespace trueline {

// First columns of the derivatives by D (packed, then its turn), w (thrust axis in I), b_az,
// gravity in E', and the start's velocity in E'.
inline constexpr int kByDrag = 0, kByTurn = 6, kByAxis = 9, kByBias = 12, kByGravity = 13,
                     kByStart = 16, kChainColumns = 19;
inline constexpr int kDragColumns = kByAxis;
template <int kRows>
using ChainSlopes = Eigen::Matrix<double, kRows, kChainColumns>;

// By the parameters of the motion and the start's velocity (kMotionColumns).
template <int kRows>
using MotionSlopes = Eigen::Matrix<double, kRows, kMotionColumns>;

// a b, column by column: compilers make straight vector code of it, unlike of Eigen's own products
// of this size.
template <class A, class B>
auto Product(const A& a, const B& b) {
  Eigen::Matrix<double, A::RowsAtCompileTime, B::ColsAtCompileTime> c;
  for (int j = 0; j < B::ColsAtCompileTime; ++j) {
    Eigen::Matrix<double, A::RowsAtCompileTime, 1> sum = a.col(0) * b(0, j);
    for (int k = 1; k < A::ColsAtCompileTime; ++k) sum += a.col(k) * b(k, j);
    c.col(j) = sum;
  }
  return c;
}

// Adds L X(u) to *sum, where X(u) d = D u.
template <int kRows, class Sum>
void AddSpread(const Eigen::Matrix<double, kRows, 3>& L, const Eigen::Vector3d& u, Sum&& sum) {
  for (int i = 0; i < 3; ++i) sum.col(i) += L.col(i) * u[i];
  sum.col(3) += L.col(0) * u[1] + L.col(1) * u[0];
  sum.col(4) += L.col(0) * u[2] + L.col(2) * u[0];
  sum.col(5) += L.col(1) * u[2] + L.col(2) * u[1];
  sum.col(6) += L.col(2) * u[1] - L.col(1) * u[2];
  sum.col(7) += L.col(0) * u[2] - L.col(2) * u[0];
  sum.col(8) += L.col(1) * u[0] - L.col(0) * u[1];
}

// X(u).
inline Eigen::Matrix<double, 3, kDragColumns> Spread(const Eigen::Vector3d& u) {
  Eigen::Matrix<double, 3, kDragColumns> X;
  X << u[0], 0.0, 0.0, u[1], u[2], 0.0, 0.0, u[2], -u[1],  //
      0.0, u[1], 0.0, u[0], 0.0, u[2], -u[2], 0.0, u[0],   //
      0.0, 0.0, u[2], 0.0, u[0], u[1], u[1], -u[0], 0.0;
  return X;
}

// Moves the slopes over the block that moves the velocity v (E', m/s) by x.
inline void PropagateSlopes(const BlockModel<double>& model, const MotionBlock& m,
                            const BlockMotion<double>& x, const Eigen::Vector3d& v,
                            ChainSlopes<6>* slopes) {
  using Both = Eigen::Matrix<double, 6, 3>;  // rows of p, then of v
  const double h = m.h;
  const Eigen::Matrix3d &A = x.A, &A_tau = x.A_tau;
  const Eigen::Matrix3d AA = Product(A, A);
  Eigen::Matrix3d V = A_tau + Product(A_tau, A_tau) * (1.0 / h) - AA * (h / 12.0);
  V.diagonal().array() += h;
  Both QV;
  QV.topRows<3>() = h * V - (h * h / 3.0) * A - (h / 3.0) * Product(A, A_tau) + (h * h / 24.0) * AA;
  QV.bottomRows<3>() = V;
  const Both QV_h = QV * (1.0 / h);

  // What the columns gained before this block.
  Both carry = Product(QV_h, A);
  carry.topRows<3>() -= A_tau;
  carry.topRows<3>().diagonal().array() += h;
  carry.bottomRows<3>().diagonal().array() += 1.0;
  const Eigen::Matrix<double, 3, kChainColumns> d_v = slopes->bottomRows<3>();
  slopes->bottomRows<3>().setZero();
  *slopes += Product(carry, d_v);

  // By D, through A and through A_tau.
  const Eigen::Vector3d A_a1 = A * x.first_a;
  Eigen::Matrix<double, 6, kDragColumns> by_A, by_A_tau;
  by_A.topRows<3>() =
      Spread(-(h * h / 24.0) * A_a1 - (h * h / 3.0) * x.a - (h / 2.0) * x.free_curve);
  by_A.bottomRows<3>() = Spread((-h / 12.0) * A_a1);
  AddSpread(QV_h, v + x.free_curve, by_A);
  Both of_a1;
  of_a1.topRows<3>() = (-h * h / 24.0) * A;
  of_a1.bottomRows<3>() = (-h / 12.0) * A;
  AddSpread(of_a1, x.first_a, by_A);
  by_A_tau.topRows<3>() = Spread(h * x.a - v);
  by_A_tau.bottomRows<3>() = Spread(x.a);
  of_a1.topRows<3>() = A_tau - (h / 3.0) * A;
  of_a1.bottomRows<3>() = A_tau * (1.0 / h);
  AddSpread(of_a1, x.first_a, by_A_tau);
  const Eigen::Matrix<double, 6, 6> by_RR = by_A.leftCols<6>(), by_RR_tau = by_A_tau.leftCols<6>();
  const Both by_R = by_A.rightCols<3>(), by_R_tau = by_A_tau.rightCols<3>();
  slopes->middleCols<6>(kByDrag) += Product(by_RR, m.RR_dt) + Product(by_RR_tau, m.RR_tau_dt);
  slopes->middleCols<3>(kByTurn) += Product(by_R, m.R_dt) + Product(by_R_tau, m.R_tau_dt);

  // By the thrust's axis and its bias.
  Eigen::Matrix<double, 3, 4> d_f, d_s;
  d_f.leftCols<3>() = m.Ra_dt - model.b_az * m.R_dt;
  d_f.col(3) = m.R_dt * -model.w;
  d_s.leftCols<3>() = m.Ra_tau_dt - model.b_az * m.R_tau_dt;
  d_s.col(3) = m.R_tau_dt * -model.w;
  const Eigen::Matrix<double, 3, 4> A_d_curve = Product(A, (0.5 * d_f - (1.0 / h) * d_s).eval());
  auto by_thrust = slopes->middleCols<4>(kByAxis);
  by_thrust += Product(QV_h, (d_f + A_d_curve).eval());
  by_thrust.topRows<3>() -= d_s + (0.5 * h) * A_d_curve;

  // By gravity.
  QV.topRows<3>().diagonal().array() -= 0.5 * h * h;
  slopes->middleCols<3>(kByGravity) += QV;
}

// Derivatives of a rotation by its three angles.
inline std::array<Eigen::Matrix3d, 3> RotationSlopes(const Eigen::Vector3d& angles) {
  using Jet = ceres::Jet<double, 3>;
  const Matrix3<Jet> R =
      RotationFromEuler<Jet>(Vector3<Jet>(Jet(angles[0], 0), Jet(angles[1], 1), Jet(angles[2], 2)));
  std::array<Eigen::Matrix3d, 3> slopes;
  for (int k = 0; k < 3; ++k) slopes[k] = R.unaryExpr([k](const Jet& x) { return x.v[k]; });
  return slopes;
}

// The model and its derivatives at one value of the parameters and of the velocity at the start.
class LinearisedModel {
 public:
  // Derivatives are by the parameters in multiples of `unit`.
  LinearisedModel(const ImuDrivenModel<double>& model, const Eigen::Vector3d& v_E,
                  const Eigen::Matrix<double, kMotionSize, 1>& unit)
      : model_(model), block_model_(model), v_E_(v_E), unit_(unit) {
    DifferentiateDrag();
    d_R_Ep_E_ = RotationSlopes(model_.parameters().Phi_E_Ep);
    for (int k = 0; k < 3; ++k) {
      d_R_Ep_E_[k] *= unit_[kAhrsInTheta + k];
      d_ahrs_.col(k).head<3>() = d_R_Ep_E_[k] * model_.g_E();
      d_ahrs_.col(k).tail<3>() = d_R_Ep_E_[k] * v_E_;
    }
  }

  const ImuDrivenModel<double>& model() const { return model_; }
  const BlockModel<double>& block_model() const { return block_model_; }

  // (p, v) in E' at the start, relative to the start's position, and their slopes.
  MotionState<double> Start() const { return {Eigen::Vector3d::Zero(), model_.R_Ep_E() * v_E_}; }
  static ChainSlopes<6> StartSlopes() {
    ChainSlopes<6> slopes = ChainSlopes<6>::Zero();
    slopes.bottomRightCorner<3, 3>().setIdentity();
    return slopes;
  }

  // Propagate (motion_block.h) with slopes.
  void Propagate(const MotionBlock& m, MotionState<double>* state, ChainSlopes<6>* slopes) const {
    BlockMotion<double> x = MotionOver(block_model_, m, state->v);
    PropagateSlopes(block_model_, m, x, state->v, slopes);
    state->p += x.dp;
    state->v += x.dv;
  }

  // From derivatives along the chain to those by the parameters.
  template <int kRows>
  MotionSlopes<kRows> ByParameters(const ChainSlopes<kRows>& by) const {
    MotionSlopes<kRows> slopes;
    const Eigen::Matrix<double, kRows, kDragColumns> by_drag =
        by.template middleCols<kDragColumns>(kByDrag);
    const Eigen::Matrix<double, kRows, 3> by_axis = by.template middleCols<3>(kByAxis);
    const Eigen::Matrix<double, kRows, 6> by_ahrs = by.template middleCols<6>(kByGravity);
    const Eigen::Matrix<double, kRows, 3> by_start = by.template middleCols<3>(kByStart);
    constexpr int kThrustBiasInTheta = InTheta("b_az");
    slopes.template middleCols<2>(kDragInTheta) = Product(by_drag, d_drag_);
    slopes.col(kThrustBiasInTheta) = by.col(kByBias) * unit_[kThrustBiasInTheta];
    slopes.template middleCols<3>(kAhrsInTheta) = Product(by_ahrs, d_ahrs_);
    slopes.template middleCols<3>(kTurnInTheta) =
        Product(by_drag, d_drag_turn_) + Product(by_axis, d_axis_);
    slopes.template rightCols<3>() = Product(by_start, model_.R_Ep_E());
    return slopes;
  }

  // Of (p, v) in E.
  MotionSlopes<6> InEarth(const MotionState<double>& state, const ChainSlopes<6>& by) const {
    const Eigen::Matrix3d R_E_Ep = model_.R_Ep_E().transpose();
    const MotionSlopes<6> in_Ep = ByParameters<6>(by);
    MotionSlopes<6> slopes;
    slopes.topRows<3>() = Product(R_E_Ep, in_Ep.topRows<3>());
    slopes.bottomRows<3>() = Product(R_E_Ep, in_Ep.bottomRows<3>());
    for (int k = 0; k < 3; ++k) {
      slopes.col(kAhrsInTheta + k).head<3>() += d_R_Ep_E_[k].transpose() * state.p;
      slopes.col(kAhrsInTheta + k).tail<3>() += d_R_Ep_E_[k].transpose() * state.v;
    }
    return slopes;
  }

 private:
  static constexpr int kTurnInTheta = InTheta("phi_I_B");  // Phi_I_B

  // Of D and w by drag and misalignment, by Jets.
  void DifferentiateDrag() {
    using Jet = ceres::Jet<double, 5>;
    const ImuDrivenParameters<double>& p = model_.parameters();
    ImuDrivenParameters<Jet> jets;
    jets.K_x = Jet(p.K_x, 0);
    jets.K_y = Jet(p.K_y, 1);
    for (int k = 0; k < 3; ++k) jets.Phi_I_B[k] = Jet(p.Phi_I_B[k], 2 + k);
    const BlockModel<Jet> block(ImuDrivenModel<Jet>(jets, 0.0, model_.axis()));
    Eigen::Matrix<double, 5, 1> unit;
    unit << unit_.segment<2>(kDragInTheta), unit_.segment<3>(kTurnInTheta);
    Eigen::Matrix<double, kDragColumns + 3, 5> slopes;  // of D, packed, its turn, and w
    for (int i = 0; i < 6; ++i) slopes.row(i) = block.drag[i].v.transpose();
    for (int i = 0; i < 3; ++i) slopes.row(kByTurn + i) = block.turn[i].v.transpose();
    for (int i = 0; i < 3; ++i) slopes.row(kByAxis + i) = block.w[i].v.transpose();
    slopes *= unit.asDiagonal();
    d_drag_ = slopes.topLeftCorner<kDragColumns, 2>();
    d_drag_turn_ = slopes.topRightCorner<kDragColumns, 3>();
    d_axis_ = slopes.bottomRightCorner<3, 3>();
  }

  ImuDrivenModel<double> model_;
  BlockModel<double> block_model_;
  Eigen::Vector3d v_E_;
  Eigen::Matrix<double, kMotionSize, 1> unit_;
  Eigen::Matrix<double, kDragColumns, 2> d_drag_;       // of D by K_x and K_y
  Eigen::Matrix<double, kDragColumns, 3> d_drag_turn_;  // of D by the misalignment
  Eigen::Matrix3d d_axis_;                              // of w by the misalignment
  Eigen::Matrix<double, 6, 3> d_ahrs_;                  // of gravity and start's velocity in E'
  std::array<Eigen::Matrix3d, 3> d_R_Ep_E_;             // by the AHRS error
};

}  // namespace trueline
