// The unknowns of one segment of a chain, at its start.
#pragma once

#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/process_noise.h"

namespace trueline {

// The result of one integration of a segment, shared by the cost functions that depend on it.
//
// A window is cut into segments. Its unknowns are three kinds of parameter blocks: `theta` (the
// parameters kTheta; shared by all segments); `drift` (a
// segment's AHRS error less the constant Phi_E_Ep); and `state` (p_E in m, v_E in m/s at a
// segment's start). Theta and drift are in units of theta's prior sigma. An EvaluationCallback
// integrates every segment once for each evaluation point; the cost functions only read nodes.
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

// Drift (the AHRS error less the constant Phi_E_Ep, in units of theta's prior sigma) and state (p_E
// in m, v_E in m/s) are one parameter block of kGustAt numbers. The gust (horizontal specific force
// in E, m/s^2, linear to the next segment's) is another, where gusts are modelled.
inline constexpr int kNodeSize = kDriftSize + kStateSize + kGustSize;
inline constexpr int kStateAt = kDriftSize;
inline constexpr int kGustAt = kDriftSize + kStateSize;
using NodeVector = Eigen::Matrix<double, kNodeSize, 1>;
using ThetaVector = Eigen::Matrix<double, kThetaSize, 1>;

// Which gusts act in a segment: none; its own, constant to the segment's end; or its own and the
// next segment's.
enum class Gusts { kNone, kHeld, kLinked };

// Derivatives of kSize numbers that are read from a segment by the gusts at its start and end.
template <int kSize>
struct GustSlope {
  using ByGust = Eigen::Matrix<double, kSize, kGustSize>;

  Gusts gusts = Gusts::kNone;
  Eigen::Matrix<double, kSize, 2 * kGustSize> d = Eigen::Matrix<double, kSize, 4>::Zero();

  ByGust Own() const {
    return gusts == Gusts::kHeld ? ByGust(d.template leftCols<2>() + d.template rightCols<2>())
                                 : ByGust(d.template leftCols<2>());
  }
  ByGust Next() const { return d.template rightCols<2>(); }
};

}  // namespace trueline
