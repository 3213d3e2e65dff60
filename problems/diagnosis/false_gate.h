// Fixes that belong to no gate: many that lie apart from the path by one and the same offset.
#pragma once

#include <optional>

#include "problems/diagnosis/search.h"

namespace trueline {

struct FalseGate {
  std::vector<std::size_t> fixes;  // indices into the log's fixes
  double fraction = 0.0;           // of the fixes near enough to show the offset
  double sigma = 0.0;              // of the fraction
  int gate = -1;                   // the only gate that it happens at; -1: any
  Eigen::Vector3d offset =
      Eigen::Vector3d::Zero();  // m, E: what is taken for the gate stands there
  double p = 1.0;               // that so many outliers agree by chance
};

// Detectors have outliers; only those that agree on a place are a false gate.
std::optional<FalseGate> FindFalseGate(const BaseFlight& flight, const BaseFit& fit, double alpha);

// The fraction that would be found with 95 % power if what is taken for the gate stood 1 m off.
double DetectableFraction(const BaseFlight& flight, const BaseFit& fit, double alpha);

}  // namespace trueline
