#pragma once

#include <vector>

#include "problems/log/flight_log.h"

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

}  // namespace trueline
