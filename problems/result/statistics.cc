#include "problems/result/statistics.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
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

namespace {

namespace bm = boost::math;
// Values out of range give infinity or no number, no exception.
using Quiet = bm::policies::policy<bm::policies::domain_error<bm::policies::ignore_error>,
                                   bm::policies::overflow_error<bm::policies::ignore_error>,
                                   bm::policies::evaluation_error<bm::policies::ignore_error>,
                                   bm::policies::promote_double<false>>;

}  // namespace

double ChiSquareTail(double x, double dof) {
  return x <= 0.0 ? 1.0 : bm::gamma_q(0.5 * dof, 0.5 * x, Quiet());
}

double FTail(double x, double d1, double d2) {
  return x <= 0.0 ? 1.0 : bm::ibeta(0.5 * d2, 0.5 * d1, d2 / (d2 + d1 * x), Quiet());
}

UncertainSigma::UncertainSigma(double ratio, double dof, double spread) {
  constexpr double kStep = 0.02;  // of log r
  constexpr int kSteps = 500;
  const double likeliest = std::max(0.0, 0.5 * std::log(ratio));
  for (int i = 0; i < kSteps; ++i) {
    const double u = i * kStep;
    r_.push_back(std::exp(u));
    weight_.push_back(-0.5 * u * u / (spread * spread) - dof * (u - likeliest) -
                      0.5 * dof * ratio * std::exp(-2.0 * u));
  }
  const double most = *std::max_element(weight_.begin(), weight_.end());
  double sum = 0.0;
  for (double& weight : weight_) sum += weight = std::exp(weight - most);
  for (double& weight : weight_) weight /= sum;
}

double UncertainSigma::Tail(double times) const {
  double tail = 0.0;
  for (std::size_t i = 0; i < r_.size(); ++i) {
    tail += weight_[i] * std::erfc(times / (r_[i] * std::sqrt(2.0)));
  }
  return tail;
}

double UncertainSigma::Factor() const {
  double square = 0.0;
  for (std::size_t i = 0; i < r_.size(); ++i) square += weight_[i] * r_[i] * r_[i];
  return std::sqrt(square);
}

double ChiSquareCritical(double p, double dof) {
  return 2.0 * bm::gamma_q_inv(0.5 * dof, p, Quiet());
}

double FCritical(double p, double d1, double d2) {
  double rest = 0.0;  // 1 - share
  const double share = bm::ibeta_inv(0.5 * d2, 0.5 * d1, p, &rest, Quiet());
  return d2 * rest / (d1 * share);
}

double BinomialCdf(int inside, int count, double p) {
  if (inside < 0) return 0.0;
  return inside >= count ? 1.0 : bm::ibetac(inside + 1.0, double(count - inside), p, Quiet());
}

double NonCentralityFor(double critical, double dof, double power) {
  if (dof == 1.0) {  // (z_critical + z_power)^2
    const double root = std::sqrt(critical) + std::sqrt(ChiSquareCritical(2.0 * (1.0 - power), 1));
    return root * root;
  }
  const auto below = [&](double lambda) {
    const double mean = dof + lambda;
    const double variance = 2.0 * (dof + 2.0 * lambda) / (9.0 * mean * mean);
    const double z = (std::cbrt(critical / mean) - (1.0 - variance)) / std::sqrt(variance);
    return 0.5 * std::erfc(-z / std::sqrt(2.0)) - (1.0 - power);
  };
  constexpr double kStep = 2.0;
  constexpr int kHalfOfDigits = std::numeric_limits<double>::digits / 2;
  std::uintmax_t steps = 200;
  const auto [low, high] = bm::tools::bracket_and_solve_root(
      below, dof, kStep, false, bm::tools::eps_tolerance<double>(kHalfOfDigits), steps);
  return 0.5 * (low + high);
}

}  // namespace trueline
