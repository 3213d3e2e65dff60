// Intervals of a statistic over flights. The bootstrap resamples flights, because arcs of one
// flight share its biases and are not independent.
#pragma once

#include <functional>
#include <optional>
#include <vector>

namespace trueline {

struct Interval {
  double low;
  double high;
};

// 95 % percentile interval of `statistic` over the pooled values of flights drawn with replacement
// (cluster bootstrap, fixed seed). `flights` holds the values of each flight. No value for fewer
// than two flights with values.
std::optional<Interval> BootstrapInterval(
    const std::vector<std::vector<double>>& flights,
    const std::function<double(const std::vector<double>&)>& statistic);

}  // namespace trueline
