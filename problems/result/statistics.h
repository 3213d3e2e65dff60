
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

namespace trueline {

// Of the regions that are stated for predictions.
inline constexpr std::array kRegionLevels = {0.5, 0.9, 0.95};

// Linear interpolation between order statistics; NaN for no values. p in [0, 1].
double Quantile(std::vector<double> values, double p);
double Mean(const std::vector<double>& values);
double RootMeanSquare(const std::vector<double>& values);

// The value itself that is in the middle, the lower or upper one of an even number: stays
// meaningful where some are infinite. There must be a value.
double LowerMedian(std::vector<double> values);
double UpperMedian(std::vector<double> values);

// Standard deviation by the median of a normal distribution's absolute values (`sizes`), or of
// those from the median; 0 for no values.
double SigmaOfSizes(std::vector<double> sizes);
double SigmaByMedian(std::vector<double> values);

// Where the parabola through three values at -1, 0 and 1 is greatest, within those; 0 where the
// values have no peak.
double ParabolaVertex(double low, double middle, double high);

struct ErrorSummary {
  int count = 0;
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
};
ErrorSummary Summarise(const std::vector<double>& values);

// Intervals of a statistic over flights. The bootstrap resamples flights, because arcs of one
// flight share its biases and are not independent.
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
