// The unknowns of one segment of a chain, at its start.
#pragma once

#include "cost_functions/models/gust.h"
#include "cost_functions/segment_node.h"

namespace trueline {

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
