#include "problems/window/motion_chain.h"

#include <cmath>

namespace trueline {

MotionChain::MotionChain(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
                         double max_block)
    : start_(start), times_(std::move(times)) {
  TimeNs from = start;
  for (const TimeNs time : times_) {
    const double span = SecondsBetween(from, time);
    const int pieces = static_cast<int>(std::ceil(span / max_block - 1e-9));
    for (int k = 0; k < pieces; ++k) {
      const TimeNs length = time - from;
      MotionBlock block;
      block.t = SecondsBetween(track.log_start(), from + length * k / pieces);
      track.ForEachStep(from + length * k / pieces, from + length * (k + 1) / pieces,
                        [&](const Drive& drive, double dt) { block.Append(drive, dt); });
      blocks_.push_back(block);
    }
    block_ends_.push_back(blocks_.size());
    from = time;
  }
}

}  // namespace trueline
