#include "problems/import/wrapped_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>

namespace trueline {
namespace {

struct Counter {
  const char* name;
  TimeNs period;
};
constexpr std::array<Counter, 5> kCounters = {{{"32 bits in us", (1LL << 32) * 1000},
                                               {"32 bits in ms", (1LL << 32) * 1'000'000},
                                               {"32 bits in ns", 1LL << 32},
                                               {"16 bits in ms", (1LL << 16) * 1'000'000},
                                               {"16 bits in us", (1LL << 16) * 1000}}};
constexpr std::size_t kFewestSteps = 5;  // that show the usual step
constexpr TimeNs kMostSteps = 50;        // usual ones, that may be missing where it wraps

}  // namespace

TimeNs WrappedClock::Undo(TimeNs stamp) {
  if (count_ == 0) first_ = last_ = stamp;
  if (period_ == 0 && count_ >= kFewestSteps && stamp < last_ && stamp >= 0) {
    const TimeNs slack = kMostSteps * (last_ - first_) / static_cast<TimeNs>(count_ - 1);
    for (const Counter& counter : kCounters) {
      const TimeNs near = std::min(slack, counter.period / 4);
      if (last_ >= counter.period || last_ < counter.period - near || stamp >= near) continue;
      period_ = counter.period;
      counter_ = counter.name;
      wrapped_at_ = last_;
      break;
    }
  }
  ++count_;
  if (period_ > 0) {
    const auto off = [&](std::int64_t epoch) { return std::abs(stamp + epoch * period_ - last_); };
    if (off(epoch_ + 1) < off(epoch_)) {
      ++epoch_;
    } else if (epoch_ > 0 && off(epoch_ - 1) < off(epoch_)) {
      --epoch_;
    }
    most_ = std::max(most_, epoch_);
  }
  return last_ = stamp + epoch_ * period_;
}

std::string WrappedClock::Text() const {
  if (most_ == 0) return "";
  return fmt::format("the counter of {} wraps {}, after {:.6f} s", counter_,
                     most_ == 1 ? "once" : fmt::format("{} times", most_), ToSeconds(wrapped_at_));
}

}  // namespace trueline
