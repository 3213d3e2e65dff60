// The reported result of a solved window.
#pragma once

#include "problems/result/estimate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/window_problem.h"

namespace trueline {

// Parameters with sigma and status, misfits, trajectory and the predicted arc of the window that
// ends with pass `tau` (from 1).
WindowEstimate DescribeWindow(const FlightData& flight, const VgdOptions& options,
                              const WindowData& data, int tau,
                              const ceres::Solver::Summary& summary, WindowProblem* problem);

// The parameters of eq. 16 of an estimate.
Theta ThetaOf(const WindowEstimate& estimate);

}  // namespace trueline
