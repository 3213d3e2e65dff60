#include "problems/window/motion_chain.h"

#include <cmath>

namespace trueline {

MotionChain::MotionChain(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
                         double max_block)
    : track_(&track), start_(start), times_(std::move(times)) {
  std::size_t count = 0;
  TimeNs from = start;
  for (const TimeNs time : times_) {
    count += static_cast<std::size_t>(std::ceil(SecondsBetween(from, time) / max_block - 1e-9));
    block_ends_.push_back(count);
    from = time;
  }
  blocks_.reserve(count);
  SumBlocks([&](const MotionBlock& block) { blocks_.push_back(block); }, [](std::size_t) {});
}

MotionBlock MotionChain::BlockBetween(TimeNs t0, TimeNs t1) const {
  MotionBlock block;
  block.t = SecondsBetween(track_->log_start(), t0);
  track_->ForEachStep(t0, t1, [&](const Drive& drive, double dt) { block.Append(drive, dt); });
  return block;
}

}  // namespace trueline
