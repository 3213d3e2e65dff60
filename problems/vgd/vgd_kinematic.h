// VGD-kinematic (Li et al. 2019, eq. 37-38): the windows of VGD with the kinematic model instead of
// the vehicle's.
#pragma once

#include "problems/result/estimate.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Runs over all windows in time order; each starts from the biases of the one before. Windows,
// loss, solver and tolerance are `vgd`'s. Parameters: b_ax ... b_gz, and Phi_E_Ep at the window's
// start if initial_attitude is on.
EstimatorRun RunVgdKinematic(const FlightData& flight, const VgdOptions& vgd,
                             const KinematicOptions& options);

// One window on its own: gamma passes up to `tau` (from 1); the search starts from `start_biases`
// (m/s^2, rad/s).
WindowEstimate SolveKinematicWindow(const FlightData& flight, const ImuInputs& imu,
                                    const VgdOptions& vgd, const KinematicOptions& options, int tau,
                                    const Eigen::Matrix<double, 6, 1>& start_biases);

}  // namespace trueline
