// Samples with one stamp: written when a queue was emptied, or rounded.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/result/statistics.h"

namespace trueline {

// Keys in a log's `source`, after the stream's name: shares of its rows.
inline constexpr char kSpreadShare[] = "spread";  // that shared a stamp
inline constexpr char kLostShare[] = "lost";      // left out as useless or out of order

struct SharedStamps {
  std::size_t repeated = 0;  // equal to the sample before in all numbers, removed
  std::size_t dropped = 0;   // shared the stamp of another as an exception, removed
  std::size_t spread = 0;    // shared the stamp of another as a rule, kept
};

inline std::string SpreadText(std::size_t spread, std::size_t all) {
  return fmt::format(
      "{:.0f} % of the samples share the stamp of another, as if written late, several at a time: "
      "they are spread evenly over the time up to it",
      100.0 * static_cast<double>(spread) / static_cast<double>(all));
}

// Archive that lists a sample's numbers.
struct NumberLister {
  std::vector<double> numbers;

  void operator()(const Field&, const Eigen::Vector3d& v) { Add(v); }
  void operator()(const Field&, const Eigen::Quaterniond& q) { Add(q.coeffs()); }
  void operator()(const Field&, double value) { numbers.push_back(value); }
  void operator()(const Field&, const std::vector<double>& values) { Add(values); }
  void Add(const auto& values) { numbers.insert(numbers.end(), values.begin(), values.end()); }
};
template <class Sample>
std::vector<double> NumbersOf(const Stream& stream, const Sample& sample) {
  NumberLister list;
  Sample::Describe(list, sample, stream);
  return list.numbers;
}

// Calls visit(begin, end) for each run of the samples 0 to count - 1 of which same(i - 1, i) holds.
template <class Same, class Visit>
void ForEachRun(std::size_t count, const Same& same, const Visit& visit) {
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin + 1;
    while (end < count && same(end - 1, end)) ++end;
    visit(begin, end);
    begin = end;
  }
}

// `samples` in the order of time. Where more than 1 % share the stamp of another, the samples of a
// stamp are spread over the time since the one before, at most at the usual distance.
template <class Sample>
SharedStamps SpreadShared(const Stream& stream, std::vector<Sample>* samples) {
  constexpr double kException = 0.01;
  const auto share = [](const Sample& a, const Sample& b) { return a.t == b.t; };
  const auto share_at = [&](std::size_t i, std::size_t k) {
    return share((*samples)[i], (*samples)[k]);
  };
  const auto drop = [&](const auto& same) {
    const std::size_t before = samples->size();
    samples->erase(std::unique(samples->begin(), samples->end(), same), samples->end());
    return before - samples->size();
  };
  SharedStamps shared;
  shared.repeated = drop([&](const Sample& a, const Sample& b) {
    return share(a, b) && NumbersOf(stream, a) == NumbersOf(stream, b);
  });
  std::vector<double> steps;  // s, between samples of different stamps, divided
  ForEachRun(samples->size(), share_at, [&](std::size_t begin, std::size_t end) {
    shared.spread += end - begin - 1;
    if (begin == 0) return;
    steps.push_back(SecondsBetween((*samples)[begin - 1].t, (*samples)[begin].t) /
                    static_cast<double>(end - begin));
  });
  if (static_cast<double>(shared.spread) <= kException * static_cast<double>(samples->size()) ||
      steps.empty()) {
    shared.dropped = drop(share);
    shared.spread = 0;
    return shared;
  }
  const double usual = UpperMedian(steps);
  TimeNs previous = 0;
  ForEachRun(samples->size(), share_at, [&](std::size_t begin, std::size_t end) {
    const TimeNs stamp = (*samples)[begin].t;
    const double room = SecondsBetween(previous, stamp) / static_cast<double>(end - begin);
    const TimeNs step = FromSeconds(begin == 0 ? usual : std::min(usual, room));
    for (std::size_t i = begin; i < end; ++i) {
      (*samples)[i].t = stamp - static_cast<TimeNs>(end - 1 - i) * step;
    }
    previous = stamp;
  });
  return shared;
}

}  // namespace trueline
