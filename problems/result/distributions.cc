#include "problems/result/distributions.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

namespace trueline {
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
