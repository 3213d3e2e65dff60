// VGD-kinematic (Li et al. 2019, eq. 37-38): the windows of VGD with the kinematic model instead of
// the vehicle's.
#pragma once

#include <vector>

#include "cost_functions/kinematic_fix_residual.h"
#include "cost_functions/models/kinematic_model.h"
#include "problems/result/estimate.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/motion_chain.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// A stretch of flight as a chain of preintegrated kinematic blocks.

// Preintegrates the IMU from t0 to t1 at its own rate; derivatives by automatic differentiation of
// KinematicStep at zero bias.
KinematicBlock SumUp(const ImuInputs& imu, TimeNs t0, TimeNs t1);

class KinematicChain : public BlockChain<KinematicBlock> {
 public:
  // The track must cover the whole.
  KinematicChain(const ImuInputs& imu, TimeNs start, std::vector<TimeNs> times, double max_block)
      : BlockChain(start, std::move(times), max_block,
                   [&](TimeNs begin, TimeNs end) { return SumUp(imu, begin, end); }),
        gravity_(imu.track().gravity()) {}

  // Integrates from `x` and calls visit(i, state) at each of the chosen times.
  template <typename T, typename Visitor>
  void Integrate(const ImuBias<T>& bias, KinematicState<T> x, Visitor&& visit) const {
    ForEachBlock([&](const KinematicBlock& block) { Propagate(block, bias, gravity_, &x); },
                 [&](std::size_t i) { visit(i, x); });
  }

 private:
  double gravity_;
};

// Effect of IMU noise on an integrated path, which a rigid integration cannot follow.
//
// Deviations of (p, v) at every node (rows 6 i ... 6 i + 5) for independent unit normal noises
// (columns): D D' is the covariance of the true path less the integrated one. Between two nodes the
// gyroscope's white noise rotates all later specific force, and the accelerometer's changes the
// velocity. With P and V the changes of p and v by specific force alone from then on,
//
//   dp = dv t - [P]x dtheta,  dv(t) = dv - [V]x dtheta.
//
// The gyroscope's three axes get their mean spectrum.
Eigen::MatrixXd PathDeviations(const std::vector<KinematicNode>& nodes, const ImuNoise& noise,
                               double gravity);

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
