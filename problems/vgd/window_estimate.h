// The reported result of a solved window.
#pragma once

#include <span>

#include "problems/result/estimate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/solver_options.h"
#include "problems/vgd/window_problem.h"

namespace trueline {

// Parameters with sigma and status, misfits, trajectory and the predicted arc of the window that
// ends with pass `tau` (from 1).
WindowEstimate DescribeWindow(const FlightData& flight, const VgdOptions& options,
                              const WindowData& data, int tau,
                              const ceres::Solver::Summary& summary, WindowProblem* problem);

// Stores by how much each fix misses `position_at`(its time), and its robust weight.
template <class PositionAt>
void StoreMisfits(std::span<const Fix> fixes, const VgdOptions& options, PositionAt&& position_at,
                  WindowEstimate* estimate) {
  for (const Fix& fix : fixes) {
    const Eigen::Vector3d error = position_at(fix.t) - fix.p_E;
    const double norm = error.norm() / (options.whiten ? fix.sigma : 1.0);
    estimate->misfits.push_back(
        {fix.t, fix.gate, error, fix.sigma, RobustWeight(options.loss, options.loss_scale, norm)});
  }
}

// The parameters of eq. 16 of an estimate.
Theta ThetaOf(const WindowEstimate& estimate);

}  // namespace trueline
