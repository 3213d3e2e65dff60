#include "problems/vgd/motion_chain.h"

#include <cmath>

namespace trueline {

MotionChain::MotionChain(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
                         double max_block)
    : start_(start), times_(std::move(times)) {
  std::size_t count = 0;
  TimeNs from = start;
  for (const TimeNs time : times_) {
    count += static_cast<std::size_t>(std::ceil(SecondsBetween(from, time) / max_block - 1e-9));
    block_ends_.push_back(count);
    from = time;
  }
  blocks_.reserve(count);
  from = start;
  for (std::size_t i = 0; i < times_.size(); ++i) {
    const TimeNs length = times_[i] - from;
    const TimeNs pieces = static_cast<TimeNs>(block_ends_[i] - blocks_.size());
    for (TimeNs k = 0; k < pieces; ++k) {
      const TimeNs begin = from + length * k / pieces, end = from + length * (k + 1) / pieces;
      MotionBlock& block = blocks_.emplace_back(
          MotionBlock{SecondsBetween(track.log_start(), begin), SecondsBetween(begin, end)});
      track.ForEachStep(begin, end,
                        [&](const Drive& drive, double dt) { block.Append(drive, dt); });
    }
    from = times_[i];
  }
}

}  // namespace trueline
