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

struct DragError {
  Eigen::Vector2d accel_xy;  // m/s^2
  double sigma;              // m/s^2

  template <class T>
  void operator()(const T* force, T* r) const {
    for (int i = 0; i < 2; ++i) r[i] = (force[i] - accel_xy[i]) / sigma;
  }
};
using DragResidual = NodeResidual<DragError, 2, 2, 2>;

}  // namespace trueline
