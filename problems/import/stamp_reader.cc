#include "problems/import/stamp_reader.h"

#include <array>
#include <cstdlib>

namespace trueline {
namespace {

constexpr std::size_t kClockRows = 11;  // around a step, whose median tells it from spikes
constexpr std::size_t kFewestRows = 6;  // on either side of a step
constexpr double kClockStep = 1.0;      // s; loggers write rows out of order by less

TimeNs MedianStamp(const std::vector<TimeNs>& stamps, std::size_t first, std::size_t last) {
  std::vector<TimeNs> some(stamps.begin() + static_cast<std::ptrdiff_t>(first),
                           stamps.begin() + static_cast<std::ptrdiff_t>(last));
  const auto middle = some.begin() + static_cast<std::ptrdiff_t>(some.size() / 2);
  std::nth_element(some.begin(), middle, some.end());
  return *middle;
}

// Whether the time before row `i` of the part from `begin` on is not reached again soon after it.
// Single stamps may be damaged, forwards or backwards.
bool StepsBack(const std::vector<TimeNs>& stamps, std::size_t begin, std::size_t i) {
  const auto later = [](TimeNs a, TimeNs b) { return ToSeconds(a) - ToSeconds(b) > kClockStep; };
  if (!later(stamps[i - 1], stamps[i])) return false;
  const std::size_t first = i > begin + kClockRows ? i - kClockRows : begin;
  const std::size_t last = std::min(stamps.size(), i + kClockRows);
  if (i - first < kFewestRows || last - i < kFewestRows) return false;
  return later(MedianStamp(stamps, first, i), MedianStamp(stamps, i, last));
}

std::vector<ClockRun> RunsOf(const std::vector<TimeNs>& stamps, std::size_t begin,
                             std::size_t end) {
  std::vector<ClockRun> runs;
  for (std::size_t i = begin; i < end; ++i) {
    const bool jumps =
        i > begin && std::abs(ToSeconds(stamps[i]) - ToSeconds(stamps[i - 1])) > kClockStep;
    if (i == begin || jumps) runs.push_back({stamps[i], stamps[i], 0});
    runs.back().from = std::min(runs.back().from, stamps[i]);
    runs.back().to = std::max(runs.back().to, stamps[i]);
    ++runs.back().count;
  }
  std::erase_if(runs, [](const ClockRun& run) { return run.count < kFewestRows; });
  return runs;
}

struct Counter {
  const char* name;
  TimeNs period;
};
constexpr std::array<Counter, 6> kCounters = {{{"a day", 24 * 3600 * kNsPerSecond},
                                               {"32 bits in us", (1LL << 32) * 1000},
                                               {"32 bits in ms", (1LL << 32) * 1'000'000},
                                               {"32 bits in ns", 1LL << 32},
                                               {"16 bits in ms", (1LL << 16) * 1'000'000},
                                               {"16 bits in us", (1LL << 16) * 1000}}};
constexpr std::size_t kFewestSteps = 5;  // that show the usual step
constexpr TimeNs kMostSteps = 50;        // usual ones, that may be missing where it wraps

}  // namespace

std::vector<ClockPart> PartsByClock(const std::vector<TimeNs>& stamps,
                                    const std::vector<std::size_t>& places) {
  std::vector<ClockPart> parts;
  const auto close = [&](std::size_t begin, std::size_t end) {
    const std::size_t few = std::min(kFewestRows, end - begin);
    parts.push_back({parts.empty() ? 0 : places[begin],
                     end == stamps.size() ? places.back() + 1 : places[end], end - begin,
                     MedianStamp(stamps, begin, begin + few), MedianStamp(stamps, end - few, end),
                     RunsOf(stamps, begin, end)});
  };
  std::size_t begin = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    if (!StepsBack(stamps, begin, i)) continue;
    close(begin, i);
    begin = i;
  }
  if (!stamps.empty()) close(begin, stamps.size());
  return parts;
}

bool AnyOverlap(const std::vector<ClockPart>& parts) {
  if (parts.size() < 2) return false;
  std::vector<ClockRun> runs;
  for (const ClockPart& part : parts) runs.insert(runs.end(), part.runs.begin(), part.runs.end());
  std::sort(runs.begin(), runs.end(),
            [](const ClockRun& a, const ClockRun& b) { return a.from < b.from; });
  TimeNs last = runs.empty() ? 0 : runs.front().to;
  for (std::size_t i = 1; i < runs.size(); ++i) {
    if (ToSeconds(last) - ToSeconds(runs[i].from) > kClockStep) return true;
    last = std::max(last, runs[i].to);
  }
  return false;
}

double CoveredBy(std::vector<TimeNs> stamps) {
  constexpr double kLongGap = 2.0;  // s
  std::sort(stamps.begin(), stamps.end());
  double covered = 0.0;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    covered += std::min(kLongGap, ToSeconds(stamps[i]) - ToSeconds(stamps[i - 1]));
  }
  return covered;
}

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
