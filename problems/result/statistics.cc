#include "problems/result/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace trueline {

double Quantile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double position = p * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (position - static_cast<double>(below)) * (values[above] - values[below]);
}

double Mean(const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double RootMeanSquare(const std::vector<double>& values) {
  std::vector<double> squares(values);
  for (double& value : squares) value *= value;
  return std::sqrt(Mean(squares));
}

namespace {

double OrderStatistic(std::vector<double> values, std::size_t index) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(index);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

double LowerMedian(std::vector<double> values) {
  return OrderStatistic(values, (values.size() - 1) / 2);
}

double UpperMedian(std::vector<double> values) { return OrderStatistic(values, values.size() / 2); }

double SigmaOfSizes(std::vector<double> sizes) {
  return sizes.empty() ? 0.0 : 1.4826 * UpperMedian(std::move(sizes));
}

double SigmaByMedian(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const double median = UpperMedian(values);
  for (double& value : values) value = std::abs(value - median);
  return SigmaOfSizes(std::move(values));
}

double ParabolaVertex(double low, double middle, double high) {
  const double bend = low - 2.0 * middle + high;
  if (!(bend < 0.0) || !std::isfinite(bend)) return 0.0;
  return std::clamp(0.5 * (low - high) / bend, -1.0, 1.0);
}

ErrorSummary Summarise(const std::vector<double>& values) {
  return {static_cast<int>(values.size()), Mean(values), Quantile(values, 0.5),
          Quantile(values, 0.95)};
}

}  // namespace trueline
