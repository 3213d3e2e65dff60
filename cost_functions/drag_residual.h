// The residual of the accelerometer's x and y axes against modelled drag.
//
//   prediction: x and y of R_I_B (K_x v_B,x, K_y v_B,y, a_z - b_az) + (b_ax, b_ay), by eq. 7-9 of
//               Li et al. 2019; a mean over a short interval, so that vibration averages out
//   error:      prediction less the accelerometer's mean, in m/s^2
//   weighting:  divided by the sigma of such a mean
//
// The paper does not use these two axes. They measure air speed through drag, also on arcs.
#pragma once

#include "cost_functions/node_residual.h"

namespace trueline {

class DragResidual : public NodeResidual<2, 2> {
 public:
  // sigma in m/s^2.
  DragResidual(const ForceNode* node, const Eigen::Vector2d& accel_xy, double sigma)
      : NodeResidual(node, accel_xy, Eigen::Vector2d::Constant(1.0 / sigma)) {}
};

}  // namespace trueline
