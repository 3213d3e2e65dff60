#include "problems/result/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "problems/common/random.h"

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

std::optional<Interval> BootstrapInterval(
    const std::vector<std::vector<double>>& flights,
    const std::function<double(const std::vector<double>&)>& statistic) {
  constexpr int kResamples = 1000;
  std::vector<const std::vector<double>*> with_values;
  for (const auto& flight : flights) {
    if (!flight.empty()) with_values.push_back(&flight);
  }
  if (with_values.size() < 2) return std::nullopt;
  Random random(0, "bootstrap");
  std::vector<double> statistics, pooled;
  for (int k = 0; k < kResamples; ++k) {
    pooled.clear();
    for (std::size_t i = 0; i < with_values.size(); ++i) {
      const auto& flight =
          *with_values[random.UniformInt(0, static_cast<int>(with_values.size()) - 1)];
      pooled.insert(pooled.end(), flight.begin(), flight.end());
    }
    statistics.push_back(statistic(pooled));
  }
  return Interval{Quantile(statistics, 0.025), Quantile(statistics, 0.975)};
}

}  // namespace trueline
