// How much of the variance of an error a quantity explains: one-way analysis of variance.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace trueline {

// Bins of about equal number, from 0; -1 where there is no value.
std::vector<int> QuantileBins(const std::vector<double>& values, int bins);

struct VarianceShare {
  double share;  // 0 to 1, less what chance explains
  double p;      // probability of as much by chance
};

// Of both axes together; entries with the same bin are a group.
VarianceShare VarianceShareOf(const std::vector<Eigen::Vector2d>& errors,
                              const std::vector<int>& bin);

}  // namespace trueline
