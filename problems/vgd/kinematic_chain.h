// A stretch of flight as a chain of preintegrated kinematic blocks.
#pragma once

#include <vector>

#include "cost_functions/kinematic_fix_residual.h"
#include "cost_functions/models/kinematic_model.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Preintegrates the IMU from t0 to t1 at its own rate; derivatives by automatic differentiation of
// KinematicStep at zero bias.
KinematicBlock SumUp(const ImuInputs& imu, TimeNs t0, TimeNs t1);

class KinematicChain {
 public:
  // Blocks from `start` through all `times` (ascending, >= start), none longer than max_block
  // seconds. The track must cover the whole.
  KinematicChain(const ImuInputs& imu, TimeNs start, std::vector<TimeNs> times, double max_block);

  // Integrates from `x` and calls visit(i, state) at each of the chosen times.
  template <typename T, typename Visitor>
  void Integrate(const ImuBias<T>& bias, KinematicState<T> x, Visitor&& visit) const {
    std::size_t block = 0;
    for (std::size_t i = 0; i < times_.size(); ++i) {
      for (; block < block_ends_[i]; ++block) Propagate(blocks_[block], bias, gravity_, &x);
      visit(i, x);
    }
  }

  TimeNs start() const { return start_; }
  const std::vector<TimeNs>& times() const { return times_; }

 private:
  double gravity_;
  TimeNs start_;
  std::vector<TimeNs> times_;
  std::vector<KinematicBlock> blocks_;
  std::vector<std::size_t> block_ends_;  // by time: how many blocks lie before it
};

// Effect of IMU noise on an integrated path, which a rigid integration cannot follow.

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

}  // namespace trueline
