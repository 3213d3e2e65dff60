// What one integration of a segment leaves behind for the cost functions that share it.
//
// A window is cut into segments. Its unknowns are three kinds of parameter blocks: `body` (drag,
// biases, misalignment; shared by all segments) and `ahrs` (Phi_E_Ep, one for each segment), both
// in units of their prior sigma, and `state` (p_E in m, v_E in m/s at a segment's start). An
// EvaluationCallback integrates every segment once for each evaluation point, however many
// residuals hang on it; the cost functions only read nodes.
#pragma once

#include <Eigen/Core>
#include <array>

namespace trueline {

// body: K_x, K_y, b_az, phi_I_B, theta_I_B, psi_I_B, b_ax, b_ay.
inline constexpr int kBodySize = 8;
inline constexpr int kAhrsSize = 3;
inline constexpr int kStateSize = 6;

// kSize numbers at one instant with their derivatives to the three blocks.
template <int kSize>
struct SegmentNode {
  template <int kCols>
  using Jacobian = Eigen::Matrix<double, kSize, kCols, Eigen::RowMajor>;

  Eigen::Matrix<double, kSize, 1> value = Eigen::Matrix<double, kSize, 1>::Zero();
  Jacobian<kBodySize> d_body = Jacobian<kBodySize>::Zero();
  Jacobian<kAhrsSize> d_ahrs = Jacobian<kAhrsSize>::Zero();
  Jacobian<kStateSize> d_state = Jacobian<kStateSize>::Zero();
};

using StateNode = SegmentNode<6>;  // p_E (m), v_E (m/s)
using ForceNode = SegmentNode<2>;  // x and y of the specific force in I (m/s^2), biases included

}  // namespace trueline
