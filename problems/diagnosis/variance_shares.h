// Share of the variance of an error that a variable explains: one-way analysis of variance.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace trueline {

// Bins of about equal count, numbered from 0; -1 for missing values.
std::vector<int> QuantileBins(const std::vector<double>& values, int bins);

struct VarianceShare {
  double share;  // 0 to 1, less the share expected by chance
  double p;      // probability of as much by chance
};

// Over both axes together; entries with the same bin form a group.
VarianceShare VarianceShareOf(const std::vector<Eigen::Vector2d>& errors,
                              const std::vector<int>& bin);

}  // namespace trueline
