#pragma once

#include <vector>

namespace trueline {

// Linear interpolation between order statistics; NaN for no values. p in [0, 1].
double Quantile(std::vector<double> values, double p);
double Mean(const std::vector<double>& values);

struct ErrorSummary {
  int count = 0;
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
};
ErrorSummary Summarise(const std::vector<double>& values);

// Probability of `inside` or fewer hits out of `count` where each has probability p: small values
// say that intervals are too narrow.
double BinomialCdf(int inside, int count, double p);

}  // namespace trueline
