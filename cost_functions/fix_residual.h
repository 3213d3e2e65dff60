// The residual of one gate fix against the integrated trajectory.
//
//   prediction: p(t_i), the trajectory of eq. 28 (Li et al. 2019) at the time of the fix, in E
//   error:      p(t_i) - fix, in m (the bracket of eq. 29)
//   weighting:  divided by the detector's sigma, the same for each axis
//
// One fix is one residual block, so that a robust loss acts on each fix separately.
#pragma once

#include "cost_functions/node_residual.h"

namespace trueline {

class FixResidual : public NodeResidual<6, 3> {
 public:
  // `node` must outlive the problem. sigma in m.
  FixResidual(const StateNode* node, const Eigen::Vector3d& fix_E, double sigma)
      : NodeResidual(node, fix_E, Eigen::Vector3d::Constant(1.0 / sigma)) {}
};

}  // namespace trueline
