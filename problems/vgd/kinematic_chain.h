// A stretch of flight as a chain of preintegrated kinematic blocks.
#pragma once

#include <vector>

#include "cost_functions/models/kinematic_block.h"
#include "problems/vgd/imu_inputs.h"

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

}  // namespace trueline
