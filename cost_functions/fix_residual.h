// Residuals of one gate fix against the integrated trajectory.
//
// One fix is one residual block, so that a robust loss acts on each fix separately.
#pragma once

#include "cost_functions/node_residual.h"

namespace trueline {

//   prediction: p(t_i), the trajectory of eq. 28 (Li et al. 2019) at the time of the fix, in E; a
//               segment (problems/vgd/segment.cc) integrates it (models/motion_block.h)
//   error:      p(t_i) - fix, in m (the bracket of eq. 29)
//   weighting:  divided by the detector's sigma, the same for each axis
struct FixError {
  Eigen::Vector3d fix_E;  // m
  double sigma;           // m

  template <class T>
  void operator()(const T* state, T* r) const {
    for (int i = 0; i < 3; ++i) r[i] = (state[i] - fix_E[i]) / sigma;
  }
};
using FixResidual = NodeResidual<FixError, 6, 3, 3>;

// A fix in a pass with an error of its own: a gate displaced from its place on the map, or another
// object detected as the gate.
//
//   prediction: p(t_i) + o + o' (t_i - t_0)
//   unknowns:   the pass's offset o (m) and its rate o' (m/s)
struct OffsetFixError {
  FixError fix;
  double elapsed;  // t_i - t_0, s

  template <class T>
  void operator()(const T* state, const T* offset, T* r) const {
    T moved[3];
    for (int i = 0; i < 3; ++i) moved[i] = state[i] + offset[i] + elapsed * offset[3 + i];
    fix(moved, r);
  }
};
inline constexpr int kOffsetSize = 6;  // o, o'
using OffsetFixResidual = NodeResidual<OffsetFixError, 6, 3, 3, kOffsetSize>;

}  // namespace trueline
