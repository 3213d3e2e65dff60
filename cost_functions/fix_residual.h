// Residuals of one gate fix against the integrated trajectory.
//
// One fix is one residual block, so that a robust loss acts on each fix separately.
#pragma once

#include "cost_functions/node_residual.h"

namespace trueline {

//   prediction: p(t_i), the trajectory of eq. 28 (Li et al. 2019) at the time of the fix, in E
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

// A fix whose detector has a latency, a misalignment, or a map with displaced gates.
//
//   prediction: p(t_i) - tau v(t_i) - (R_E_B c) x (g - p) - d, first order in all three; g - p is
//               taken from the fix itself
//   unknowns:   mount: latency tau (s) and the camera's misalignment c (rad) in body axes; gate:
//               displacement d (m) from its place g on the map. In units of their prior sigmas
//               (zero: not estimated).
inline constexpr int kMountSize = 4;  // tau, c
inline constexpr int kGateSize = 3;   // d
struct MountedFixError {
  FixError fix;
  Eigen::Vector3d to_gate_E;                   // m, g - fix
  Eigen::Matrix3d R_E_B;                       // attitude as logged
  Eigen::Matrix<double, kMountSize, 1> mount;  // prior sigmas: s, rad
  double gate;                                 // m, prior sigma

  template <class T>
  void operator()(const T* state, const T* mount_units, const T* gate_units, T* r) const {
    Eigen::Matrix<T, 3, 1> c;
    for (int i = 0; i < 3; ++i) c[i] = mount[1 + i] * mount_units[1 + i];
    const Eigen::Matrix<T, 3, 1> c_E = R_E_B.cast<T>() * c;
    const Eigen::Matrix<T, 3, 1> turned = c_E.cross(to_gate_E.cast<T>());
    T moved[3];
    for (int i = 0; i < 3; ++i) {
      moved[i] =
          state[i] - mount[0] * mount_units[0] * state[3 + i] - turned[i] - gate * gate_units[i];
    }
    fix(moved, r);
  }
};
using MountedFixResidual = NodeResidual<MountedFixError, 6, 6, 3, kMountSize, kGateSize>;

}  // namespace trueline
