// Residuals of fixes whose error changes little from one to the next (GNSS), and whose stamps may
// be late.
#pragma once

#include <ceres/autodiff_cost_function.h>

#include "cost_functions/chain_node.h"
#include "cost_functions/fix_residual.h"
#include "cost_functions/models/cubic_path.h"

namespace trueline {

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
