// The reported result of solved windows.
#pragma once

#include <span>

#include "problems/result/estimate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/solver_options.h"
#include "problems/vgd/vgd_options.h"
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

// Sigmas of constants, widened by how much the windows of a flight disagree.
//
// A window's covariance counts its noise as white, or with the memory that the options state. On a
// flight without gates nothing tells how far that holds: forces and vibration of a longer memory
// look like the vehicle's constants. But the vehicle's constants are the same in every window, so
// windows that share no data show the true scatter: by the Birge ratio, the root of the mean square
// of their differences in sigmas. It is taken together with an expectation of one, which counts as
// two windows, and only widens.
//
// Widens the parameters of every window by it and those before it that share no pass with each
// other. The AHRS's error is left as it is, since it changes over a flight. No sigma rises above
// the prior's.
void WidenByScatter(const VgdOptions& options, EstimatorRun* run);

}  // namespace trueline
