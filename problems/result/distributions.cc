#include "problems/result/distributions.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace trueline {
namespace {

constexpr double kTiny = 1e-300;
constexpr int kTerms = 500;

// Regularised upper incomplete gamma function Q(a, x): series below a + 1, Lentz's continued
// fraction above (Abramowitz and Stegun 6.5.29, 6.5.31).
double GammaQ(double a, double x) {
  if (x <= 0.0) return 1.0;
  const double scale = std::exp(-x + a * std::log(x) - std::lgamma(a));
  if (x < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < kTerms; ++n) {
      term *= x / (a + n);
      sum += term;
      if (term < sum * 1e-15) break;
    }
    return std::max(0.0, 1.0 - sum * scale);
  }
  double b = x + 1.0 - a, c = 1.0 / kTiny, d = 1.0 / b, h = d;
  for (int i = 1; i < kTerms; ++i) {
    const double an = -i * (i - a);
    b += 2.0;
    d = an * d + b;
    if (std::abs(d) < kTiny) d = kTiny;
    c = b + an / c;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1.0 / d;
    h *= d * c;
    if (std::abs(d * c - 1.0) < 1e-15) break;
  }
  return scale * h;
}

double BetaFraction(double a, double b, double x) {
  double c = 1.0, d = 1.0 - (a + b) * x / (a + 1.0);
  d = 1.0 / (std::abs(d) < kTiny ? kTiny : d);
  double h = d;
  const auto step = [&](double term) {
    d = 1.0 + term * d;
    c = 1.0 + term / c;
    d = 1.0 / (std::abs(d) < kTiny ? kTiny : d);
    if (std::abs(c) < kTiny) c = kTiny;
    h *= d * c;
  };
  for (int m = 1; m < kTerms; ++m) {
    const double before = h;
    step(m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)));
    step(-(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)));
    if (std::abs(h / before - 1.0) < 1e-15) break;
  }
  return h;
}

// Regularised incomplete beta function (Abramowitz and Stegun 26.5.8).
double BetaI(double a, double b, double x) {
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 1.0;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1.0) / (a + b + 2.0)) return front * BetaFraction(a, b, x) / a;
  return 1.0 - front * BetaFraction(b, a, 1.0 - x) / b;
}

// The x >= 0 at which a decreasing function equals `target`.
double Falls(const std::function<double(double)>& f, double target) {
  double low = 0.0, high = 1.0;
  while (f(high) > target && high < 1e12) high *= 2.0;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (f(middle) > target ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double ChiSquareTail(double x, double dof) { return GammaQ(0.5 * dof, 0.5 * x); }

double FTail(double x, double d1, double d2) {
  return x <= 0.0 ? 1.0 : BetaI(0.5 * d2, 0.5 * d1, d2 / (d2 + d1 * x));
}

double ChiSquareCritical(double p, double dof) {
  return Falls([dof](double x) { return ChiSquareTail(x, dof); }, p);
}

double FCritical(double p, double d1, double d2) {
  return Falls([d1, d2](double x) { return FTail(x, d1, d2); }, p);
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
    return 0.5 * std::erfc(-z / std::sqrt(2.0));
  };
  return Falls(below, 1.0 - power);
}

}  // namespace trueline
