#include "problems/observability/local_gramian.h"

#include <glog/logging.h>

#include <cmath>

namespace trueline {
namespace {

constexpr int kMostNodes = 16;

// Newton's iteration on the roots of the Legendre polynomial.
Quadrature LegendreRoots(int n) {
  Quadrature rule;
  for (int k = 0; k < n; ++k) {
    double x = std::cos(M_PI * (k + 0.75) / (n + 0.5)), slope = 1.0;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double p = 1.0, before = 0.0;
      for (int j = 1; j <= n; ++j) {
        const double next = ((2.0 * j - 1.0) * x * p - (j - 1.0) * before) / j;
        before = p;
        p = next;
      }
      slope = n * (x * p - before) / (x * x - 1.0);
      x -= p / slope;
    }
    rule.nodes.push_back(0.5 * (1.0 - x));
    rule.weights.push_back(1.0 / ((1.0 - x * x) * slope * slope));
  }
  return rule;
}

}  // namespace

const Quadrature& GaussLegendre(int n) {
  static const std::vector<Quadrature> rules = [] {
    std::vector<Quadrature> all(1);
    for (int k = 1; k <= kMostNodes; ++k) all.push_back(LegendreRoots(k));
    return all;
  }();
  CHECK(n >= 1 && n <= kMostNodes);
  return rules[n];
}

}  // namespace trueline
