// Detections of another object than the gate: many fixes displaced from the path by the same
// offset.
#pragma once

#include <optional>
#include <vector>

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/diagnosis.h"

namespace trueline {

struct FalseGate {
  Cause cause;                     // of gate -1 if it happens at several
  std::vector<std::size_t> fixes;  // indices into the log's fixes
};

// Of fixes at which an offset of the detected object from the gate is a clear outlier.
struct DisplacedFixes {
  int visible = 0, displaced = 0;

  // `d`: of the fix from the path, m.
  void Add(const Eigen::Vector3d& d, double sigma, const Eigen::Vector3d& offset);
};
Eigen::Vector3d OffsetOf(const Candidate& false_gate);  // m, E

// Detectors have single outliers; only outliers that agree on one place make a false gate.
std::optional<FalseGate> FindFalseGate(const BaseFlight& flight, const BaseFit& fit, double alpha);

// The fraction of false fixes that would be found with 95 % power, for an object 1 m from the gate.
double DetectableFraction(const BaseFlight& flight, const BaseFit& fit, double alpha);

}  // namespace trueline
