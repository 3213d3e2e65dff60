// Residuals of one gate fix against the integrated trajectory.
//
// One fix is one residual block, so that a robust loss acts on each fix separately.
#pragma once

#include <ceres/autodiff_cost_function.h>

#include "cost_functions/chain_node.h"
#include "cost_functions/models/cubic_path.h"
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

// Residuals of fixes whose error changes little from one to the next (GNSS), and whose stamps may
// be late.

// Prior of the fixes' delay, s; its unknown is in units of sigma about the mean.
struct FixDelay {
  double mean = 0.0;
  double sigma = 0.0;

  template <class T>
  T At(const T* unit) const {
    return mean + sigma * unit[0];
  }
};

// The change from one fix to the next, both at the start of a segment; or the second alone.
//
//   prediction: p(t_1 - tau) - p(t_0 - tau), or p(t_1 - tau), with the delay tau
//   error:      the same less the fixes', in m
//   weighting:  divided by the sigma of the (change of the) fix's error
//   unknowns:   both nodes' drift and state, the delay
//
// The path is the cubic between the nodes. It keeps the curvature that p - tau v would lose:
// 1/2 a tau^2 is 5 cm at 7 m/s^2 and 0.12 s.
struct FixStepError {
  Eigen::Vector3d fix_E;  // m, the second, less the first where that counts
  double sigma;           // m
  double seconds;         // t_1 - t_0
  bool less_first;
  FixDelay delay;

  template <class T>
  bool operator()(const T* node, const T* next, const T* delay_unit, T* r) const {
    const T late = delay.At(delay_unit) / seconds;
    const T *a = node + kStateAt, *b = next + kStateAt;
    for (int i = 0; i < 3; ++i) {
      const auto at = [&](const T& u) {
        return CubicPath(a[i], a[3 + i], b[i], b[3 + i], seconds, u);
      };
      T moved = at(1.0 - late);
      if (less_first) moved -= at(-late);
      r[i] = (moved - fix_E[i]) / sigma;
    }
    return true;
  }
};
using FixStepResidual = ceres::AutoDiffCostFunction<FixStepError, 3, kGustAt, kGustAt, 1>;

// A fix by itself: p(t) - tau v(t) - fix.
struct DelayedFixError {
  FixError fix;
  FixDelay delay;

  template <class T>
  void operator()(const T* state, const T* delay_unit, T* r) const {
    const T tau = delay.At(delay_unit);
    T then[3];
    for (int i = 0; i < 3; ++i) then[i] = state[i] - tau * state[3 + i];
    fix(then, r);
  }
};
using DelayedFixResidual = NodeResidual<DelayedFixError, 6, 6, 3, 1>;

}  // namespace trueline
