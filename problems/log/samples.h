// Samples of a log's streams: by time, between samples, and what fixes state of their gates.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "problems/common/units.h"
#include "problems/log/flight_log.h"

namespace trueline {

double MedianSigma(const std::vector<Fix>& fixes);  // m; NaN for no fixes
// The gate of an id; null if the log has none.
const Gate* GateOf(const FlightLog& log, int id);

// Those of `samples` (ascending) with from <= t < before.
template <class Samples>
auto SamplesBetween(const Samples& samples, TimeNs from, TimeNs before) {
  using Sample = typename Samples::value_type;
  const auto first = std::ranges::lower_bound(samples, from, {}, &Sample::t);
  const auto last = std::ranges::lower_bound(first, samples.end(), before, {}, &Sample::t);
  return std::span<const Sample>(first, last);
}

// The attitude between the samples of its stream, for times that ascend.
class AttitudeCursor {
 public:
  // `samples` must outlive this object.
  explicit AttitudeCursor(const std::vector<AttitudeSample>& samples) : samples_(samples) {}

  // False if t is outside of the stream or in a gap longer than max_gap (s).
  bool At(TimeNs t, double max_gap, Eigen::Quaterniond* q);

 private:
  const std::vector<AttitudeSample>& samples_;
  std::size_t i_ = 0;
  std::size_t turn_of_ = 0;  // to this sample
  Eigen::Vector3d turn_;     // rad, from the one before
};

}  // namespace trueline
