// How strongly errors drift, and how late the attitude is, from the flights themselves.
#pragma once

#include <memory>

#include "problems/smoother/whole_flight.h"

namespace trueline {

struct Strengths {
  VgdOptions vgd;  // with what was learned
  std::vector<LearnedStrength> learned;
  // The flights with another latency of their attitude, where that was learned; else empty.
  std::vector<std::unique_ptr<FlightData>> flights;
  std::vector<FlightShare> shares;
};

// Maximum of the marginal likelihood (Laplace's approximation over all states and parameters) in
// the logarithms of process.tilt and process.acceleration and, where asked, the latency; intervals
// from its curvature. The logarithms' priors are as wide as a factor of three.
Strengths LearnStrengths(const std::vector<FlightShare>& flights,
                         const FlightProblemOptions& options, const WholeFlightOptions& whole);

}  // namespace trueline
