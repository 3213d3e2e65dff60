// A stretch of flight as a chain of preintegrated blocks, with the states at chosen times.
#pragma once

#include <vector>

#include "cost_functions/models/motion_block.h"
#include "problems/window/drive_track.h"

namespace trueline {

class MotionChain {
 public:
  // Blocks from `start` through all `times` (ascending, >= start); none is longer than
  // max_block seconds. The track must cover the whole.
  MotionChain(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
              double max_block = 0.03);

  // States in E at the chosen times, starting from `start_E`. Any scalar; no logged datum is
  // integrated again.
  template <typename T>
  void Evaluate(const ImuDrivenParameters<T>& parameters, const MotionState<T>& start_E,
                std::vector<MotionState<T>>* states_E) const {
    const ImuDrivenModel<T> model(parameters, gravity_);
    const BlockModel<T> block_model(model);
    const Matrix3<T> R_E_Ep = model.R_Ep_E().transpose();
    MotionState<T> state;  // in E', relative to the start's position
    state.v = model.R_Ep_E() * start_E.v;
    states_E->resize(times_.size());
    std::size_t block = 0;
    for (std::size_t i = 0; i < times_.size(); ++i) {
      for (; block < block_ends_[i]; ++block) Propagate(block_model, blocks_[block], &state);
      (*states_E)[i].p = start_E.p + R_E_Ep * state.p;
      (*states_E)[i].v = R_E_Ep * state.v;
    }
  }

  TimeNs start() const { return start_; }
  const std::vector<TimeNs>& times() const { return times_; }
  std::size_t block_count() const { return blocks_.size(); }

 private:
  TimeNs start_;
  std::vector<TimeNs> times_;
  std::vector<MotionBlock> blocks_;
  std::vector<std::size_t> block_ends_;  // by time: how many blocks lie before it
  double gravity_;
};

}  // namespace trueline
