// Intervals of a figure over flights: flights are drawn anew, since arcs of one flight share its
// biases and are not independent.
#pragma once

#include <functional>
#include <optional>
#include <vector>

namespace trueline {

struct Interval {
  double low;
  double high;
};

// 95 % percentile interval of `statistic` of the pooled values of flights drawn with replacement
// (cluster bootstrap, fixed seed). `flights` holds the values of each flight. Nothing for fewer
// than two flights that have values.
std::optional<Interval> BootstrapInterval(
    const std::vector<std::vector<double>>& flights,
    const std::function<double(const std::vector<double>&)>& statistic);

}  // namespace trueline
