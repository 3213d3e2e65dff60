// Samples of a stream by time.
#pragma once

#include <algorithm>
#include <span>

#include "problems/common/units.h"

namespace trueline {

// Those of `samples` (ascending) with from <= t < before.
template <class Samples>
auto SamplesBetween(const Samples& samples, TimeNs from, TimeNs before) {
  using Sample = typename Samples::value_type;
  const auto first = std::ranges::lower_bound(samples, from, {}, &Sample::t);
  const auto last = std::ranges::lower_bound(first, samples.end(), before, {}, &Sample::t);
  return std::span<const Sample>(first, last);
}

}  // namespace trueline
