// Test of the whiteness of residuals over time.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace trueline {

struct TimedResidual {
  double t;  // s
  Eigen::VectorXd value;
};

// Two-sided p-value of the correlation between neighbours, at most `apart` seconds from each other,
// under whiteness. The statistic is the sum of products over its own empirical scatter, so heavy
// tails do not bias it; it is compared with the normal distribution.
double WhitenessOf(const std::vector<TimedResidual>& residuals, double apart);

// Sums over consecutive blocks of at least `length` seconds, each at its first time.
std::vector<TimedResidual> SumsOfBlocks(const std::vector<TimedResidual>& residuals, double length);

}  // namespace trueline
