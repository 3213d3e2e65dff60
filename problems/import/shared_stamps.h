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
struct NumbersOfSample {
  std::vector<double> numbers;

  void operator()(const Field&, const Eigen::Vector3d& v) {
    numbers.insert(numbers.end(), v.data(), v.data() + 3);
  }
  void operator()(const Field&, const Eigen::Quaterniond& q) {
    numbers.insert(numbers.end(), q.coeffs().data(), q.coeffs().data() + 4);
  }
  void operator()(const Field&, double value) { numbers.push_back(value); }
  void operator()(const Field&, int value) { numbers.push_back(value); }
  void operator()(const Field&, const std::vector<double>& values) {
    numbers.insert(numbers.end(), values.begin(), values.end());
  }
};

// `samples` in the order of time. Where more than 1 % share the stamp of another, the samples of a
// stamp are spread over the time since the one before, at most at the usual distance.
template <class Sample>
SharedStamps SpreadShared(const Stream& stream, std::vector<Sample>* samples) {
  constexpr double kException = 0.01;
  const auto numbers = [&](const Sample& sample) {
    NumbersOfSample archive;
    Sample::Describe(archive, sample, stream);
    return archive.numbers;
  };
  const auto end_of = [&](std::size_t begin) {
    std::size_t end = begin + 1;
    while (end < samples->size() && (*samples)[end].t == (*samples)[begin].t) ++end;
    return end;
  };
  SharedStamps shared;
  std::size_t before = samples->size();
  samples->erase(std::unique(samples->begin(), samples->end(),
                             [&](const Sample& a, const Sample& b) {
                               return a.t == b.t && numbers(a) == numbers(b);
                             }),
                 samples->end());
  shared.repeated = before - samples->size();
  std::vector<double> steps;  // s, between samples of different stamps, divided
  for (std::size_t begin = 0; begin < samples->size();) {
    const std::size_t end = end_of(begin), count = end - begin;
    shared.spread += count - 1;
    if (begin > 0) {
      steps.push_back(SecondsBetween((*samples)[begin - 1].t, (*samples)[begin].t) /
                      static_cast<double>(count));
    }
    begin = end;
  }
  if (static_cast<double>(shared.spread) <= kException * static_cast<double>(samples->size()) ||
      steps.empty()) {
    before = samples->size();
    samples->erase(std::unique(samples->begin(), samples->end(),
                               [](const Sample& a, const Sample& b) { return a.t == b.t; }),
                   samples->end());
    shared.dropped = before - samples->size();
    shared.spread = 0;
    return shared;
  }
  const double usual = UpperMedian(steps);
  TimeNs previous = 0;
  for (std::size_t begin = 0; begin < samples->size();) {
    const std::size_t end = end_of(begin), count = end - begin;
    const TimeNs stamp = (*samples)[begin].t;
    const double room = SecondsBetween(previous, stamp) / static_cast<double>(count);
    const TimeNs step = FromSeconds(begin == 0 ? usual : std::min(usual, room));
    for (std::size_t i = begin; i < end; ++i) {
      (*samples)[i].t = stamp - static_cast<TimeNs>(end - 1 - i) * step;
    }
    previous = stamp;
    begin = end;
  }
  return shared;
}

}  // namespace trueline
