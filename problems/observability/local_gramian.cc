#include "problems/observability/local_gramian.h"

#include <cmath>

namespace trueline {

// Newton's iteration on the roots of the Legendre polynomial.
Quadrature GaussLegendre(int n) {
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

}  // namespace trueline
