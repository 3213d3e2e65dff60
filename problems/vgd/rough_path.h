// Initial value of a fit's path from the fixes alone.
#pragma once

#include <span>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/vgd/passes.h"

namespace trueline {

// Position and velocity at one instant.
struct LineFit {
  Eigen::Vector3d p;   // m
  Eigen::Vector3d v;   // m/s
  double sigma = 0.0;  // m, of each axis of p, by the sigmas of the fixes
};

// Constant-velocity fit through fixes[first] ... fixes[last], weighted by their sigmas and robust
// against outliers (iteratively reweighted, Huber); position and velocity at time t. With one fix,
// or fixes at one instant, the velocity is zero.
LineFit FitLine(const std::vector<Fix>& fixes, std::size_t first, std::size_t last, TimeNs t);

// Straight lines through nearby fixes within passes, cubic curves over the arcs between them. A fit
// that starts here does not diverge as one that starts from an integration with poor parameters
// may.
class RoughPath {
 public:
  // `passes` must be in time order and not empty; their indices point into `fixes`.
  RoughPath(const std::vector<Fix>& fixes, std::span<const Pass> passes);

  // Position and velocity at t, which must not be after the last pass.
  LineFit At(TimeNs t) const;
  TimeNs end() const { return passes_.back().end; }

 private:
  LineFit NearFixes(const Pass& pass, TimeNs t) const;

  const std::vector<Fix>& fixes_;
  std::span<const Pass> passes_;
};

}  // namespace trueline
