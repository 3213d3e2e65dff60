// Strength of drift and gusts, and latency of the attitude, learned from the flights.
#pragma once

#include <memory>

#include "problems/smoother/whole_flight.h"

namespace trueline {

struct Strengths {
  VgdOptions vgd;  // with the learned values
  std::vector<LearnedStrength> learned;
  // The flights with the learned attitude latency; empty if it is not learned.
  std::vector<std::unique_ptr<FlightData>> flights;
  std::vector<FlightShare> shares;
};

// Maximises the marginal likelihood (Laplace's approximation over all states and parameters) over
// the logarithms of process.tilt and process.acceleration and, if whole.attitude_latency is set,
// the latency. Intervals come from the curvature. The priors of the logarithms have a sigma of a
// factor of three.
Strengths LearnStrengths(const std::vector<FlightShare>& flights,
                         const FlightProblemOptions& options, const WholeFlightOptions& whole);

}  // namespace trueline
