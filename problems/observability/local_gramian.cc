#include "problems/observability/local_gramian.h"

#include <glog/logging.h>

#include <boost/math/special_functions/legendre.hpp>

namespace trueline {
namespace {

constexpr int kMostNodes = 16;

Quadrature LegendreRule(int n) {
  const std::vector<double> upper = boost::math::legendre_p_zeros<double>(n);  // ascending from 0
  std::vector<double> roots(upper.rbegin(), upper.rend());
  for (const double x : upper) {
    if (x > 0.0) roots.push_back(-x);
  }
  Quadrature rule;
  for (const double x : roots) {
    const double slope = boost::math::legendre_p_prime(n, x);
    rule.nodes.push_back(0.5 * (1.0 - x));
    rule.weights.push_back(1.0 / ((1.0 - x * x) * slope * slope));
  }
  return rule;
}

}  // namespace

const Quadrature& GaussLegendre(int n) {
  static const std::vector<Quadrature> rules = [] {
    std::vector<Quadrature> all(1);
    for (int k = 1; k <= kMostNodes; ++k) all.push_back(LegendreRule(k));
    return all;
  }();
  CHECK(n >= 1 && n <= kMostNodes);
  return rules[n];
}

}  // namespace trueline
