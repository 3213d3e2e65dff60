#include "problems/diagnosis/variance_shares.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "problems/result/statistics.h"

namespace trueline {

std::vector<int> QuantileBins(const std::vector<double>& values, int bins) {
  std::vector<double> sorted;
  for (const double v : values) {
    if (std::isfinite(v)) sorted.push_back(v);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<int> bin;
  for (const double v : values) {
    const auto below = std::lower_bound(sorted.begin(), sorted.end(), v) - sorted.begin();
    const auto size = static_cast<long>(std::max<std::size_t>(1, sorted.size()));
    bin.push_back(std::isfinite(v) ? static_cast<int>(below * bins / size) : -1);
  }
  return bin;
}

VarianceShare VarianceShareOf(const std::vector<Eigen::Vector2d>& errors,
                              const std::vector<int>& bin) {
  std::map<int, std::pair<Eigen::Vector2d, int>> sums;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < errors.size(); ++i) {
    auto& [sum, count] = sums.try_emplace(bin[i], Eigen::Vector2d::Zero(), 0).first->second;
    sum += errors[i];
    ++count;
    mean += errors[i] / static_cast<double>(errors.size());
  }
  double within = 0.0, total = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const auto& [sum, count] = sums.at(bin[i]);
    within += (errors[i] - sum / count).squaredNorm();
    total += (errors[i] - mean).squaredNorm();
  }
  const double n = static_cast<double>(errors.size()), k = static_cast<double>(sums.size());
  if (k < 2 || n <= k + 1 || total <= 0.0) return {0.0, 1.0};
  const double by_chance = (k - 1) * within / (n - k), between = total - within;
  const double F = (between / (k - 1)) / (within / (n - k));
  return {std::max(0.0, (between - by_chance) / total), FTail(F, 2 * (k - 1), 2 * (n - k))};
}

}  // namespace trueline
