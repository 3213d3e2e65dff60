// The result of one integration of a segment, shared by the cost functions that depend on it.
//
// A window is cut into segments. Its unknowns are three kinds of parameter blocks: `theta` (the
// parameters kTheta; shared by all segments); `drift` (a
// segment's AHRS error less the constant Phi_E_Ep); and `state` (p_E in m, v_E in m/s at a
// segment's start). Theta and drift are in units of theta's prior sigma. An EvaluationCallback
// integrates every segment once for each evaluation point; the cost functions only read nodes.
#pragma once

#include "cost_functions/models/imu_driven_model.h"

namespace trueline {

inline constexpr int kDriftSize = 3;
inline constexpr int kStateSize = 6;

// kSize numbers at one instant with their derivatives by the blocks.
template <int kSize>
struct SegmentNode {
  template <int kCols>
  using Jacobian = Eigen::Matrix<double, kSize, kCols>;

  Eigen::Matrix<double, kSize, 1> value = Eigen::Matrix<double, kSize, 1>::Zero();
  Jacobian<kThetaSize> d_theta = Jacobian<kThetaSize>::Zero();
  Jacobian<kStateSize> d_state = Jacobian<kStateSize>::Zero();

  // Drift adds to Phi_E_Ep, in the same unit.
  auto d_drift() const { return d_theta.template middleCols<kDriftSize>(kAhrsInTheta); }
};

using StateNode = SegmentNode<6>;  // p_E (m), v_E (m/s)
using ForceNode = SegmentNode<2>;  // x and y of the specific force in I (m/s^2), biases included

}  // namespace trueline
