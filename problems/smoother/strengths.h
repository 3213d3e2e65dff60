// Strength of drift and gusts, and latency of the attitude, learned from the flights.
#pragma once

#include <memory>

#include "problems/smoother/flight_problem.h"
#include "problems/smoother/whole_flight.h"

namespace trueline {

struct Strengths {
  VgdOptions vgd;  // with the strengths' root mean squares, and the learned latency
  std::vector<LearnedStrength> learned;
  // The flights with the learned attitude latency; empty if it is not learned.
  std::vector<std::unique_ptr<FlightData>> flights;
  std::vector<FlightShare> shares;
  // False if the search ended before it settled: the values are the last ones tried.
  bool converged = true;
};

// Maximises the marginal likelihood (Laplace's approximation over all states and parameters) over
// the logarithms of process.tilt, process.acceleration across and along the thrust and, where the
// accelerometer measures drag, process.gust and the forces' scale; and over the latency if
// whole.attitude_latency is set. Intervals come from the curvature. The priors of the logarithms
// have a sigma of a factor of three.
Strengths LearnStrengths(const std::vector<FlightShare>& flights,
                         const FlightProblemOptions& options, const WholeFlightOptions& whole);

}  // namespace trueline
