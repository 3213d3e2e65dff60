#include "problems/window/motion_chain.h"

#include <cmath>

namespace trueline {

MotionChain::MotionChain(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
                         double max_block)
    : start_(start), times_(std::move(times)) {
  const auto pieces_of = [&](TimeNs from, TimeNs to) {
    return static_cast<int>(std::ceil(SecondsBetween(from, to) / max_block - 1e-9));
  };
  std::size_t count = 0;
  TimeNs from = start;
  for (const TimeNs time : times_) {
    count += pieces_of(from, time);
    block_ends_.push_back(count);
    from = time;
  }
  blocks_.reserve(count);
  from = start;
  for (const TimeNs time : times_) {
    const int pieces = pieces_of(from, time);
    for (int k = 0; k < pieces; ++k) {
      const TimeNs length = time - from;
      MotionBlock& block = blocks_.emplace_back();
      block.t = SecondsBetween(track.log_start(), from + length * k / pieces);
      track.ForEachStep(from + length * k / pieces, from + length * (k + 1) / pieces,
                        [&](const Drive& drive, double dt) { block.Append(drive, dt); });
    }
    from = time;
  }
}

}  // namespace trueline
