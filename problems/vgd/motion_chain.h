// A stretch of flight as a chain of preintegrated blocks, with the states at chosen times.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "cost_functions/models/motion_block.h"
#include "problems/vgd/drive_track.h"

namespace trueline {

// Blocks from `start` through all `times` (ascending, >= start), none longer than so many seconds;
// each block ends at or before the next of the times.
template <class Block>
class BlockChain {
 public:
  TimeNs start() const { return start_; }
  const std::vector<TimeNs>& times() const { return times_; }

 protected:
  // make(begin, end) gives the block of that time.
  template <class Make>
  BlockChain(TimeNs start, std::vector<TimeNs> times, double longest, Make&& make)
      : start_(start), times_(std::move(times)) {
    std::size_t count = 0;
    TimeNs from = start;
    for (const TimeNs time : times_) {
      count += static_cast<std::size_t>(std::ceil(SecondsBetween(from, time) / longest - 1e-9));
      block_ends_.push_back(count);
      from = time;
    }
    blocks_.reserve(count);
    from = start;
    for (std::size_t i = 0; i < times_.size(); ++i) {
      const TimeNs length = times_[i] - from;
      const TimeNs pieces = static_cast<TimeNs>(block_ends_[i] - blocks_.size());
      for (TimeNs k = 0; k < pieces; ++k) {
        blocks_.push_back(make(from + length * k / pieces, from + length * (k + 1) / pieces));
      }
      from = times_[i];
    }
  }

  // Calls move(block) for each block and reached(i) at each of the chosen times.
  template <typename Move, typename Reached>
  void ForEachBlock(Move&& move, Reached&& reached) const {
    std::size_t block = 0;
    for (std::size_t i = 0; i < times_.size(); ++i) {
      for (; block < block_ends_[i]; ++block) move(blocks_[block]);
      reached(i);
    }
  }

 private:
  TimeNs start_;
  std::vector<TimeNs> times_;
  std::vector<Block> blocks_;
  std::vector<std::size_t> block_ends_;  // for each time: number of blocks before it
};

class MotionChain : public BlockChain<MotionBlock> {
 public:
  // The track must cover the whole.
  MotionChain(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
              double max_block = 0.05)
      : BlockChain(start, std::move(times), max_block, [&](TimeNs begin, TimeNs end) {
          MotionBlock block{SecondsBetween(track.log_start(), begin), SecondsBetween(begin, end)};
          track.ForEachStep(begin, end,
                            [&](const Drive& drive, double dt) { block.Append(drive, dt); });
          return block;
        }) {}

  // Integrates from `start_E` and calls visit(i, state_E, v_Ep) at each of the chosen times, with
  // the velocity in E' as well. Works for any scalar; logged data are preintegrated once.
  // `effects`: force beyond linear drag, or null.
  template <typename T, typename Visitor>
  void Integrate(const ImuDrivenModel<T>& model, const MotionState<T>& start_E, Visitor&& visit,
                 const ForceEffects* effects = nullptr) const {
    BlockModel<T> block_model(model, effects);
    block_model.start_E = start_E.p;
    const Matrix3<T> R_E_Ep = model.R_Ep_E().transpose();
    MotionState<T> state;  // in E', relative to the start's position
    state.v = model.R_Ep_E() * start_E.v;
    ForEachBlock(
        [&](const MotionBlock& block) { Propagate(block_model, block, &state); },
        [&](std::size_t i) {
          visit(i, MotionState<T>{start_E.p + R_E_Ep * state.p, R_E_Ep * state.v}, state.v);
        });
  }
};

}  // namespace trueline
