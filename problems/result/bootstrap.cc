#include "problems/result/bootstrap.h"

#include "problems/common/random.h"
#include "problems/result/statistics.h"

namespace trueline {

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
