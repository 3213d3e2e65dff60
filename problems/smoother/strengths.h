// Strength of drift and gusts, learned from the flights.
#pragma once

#include "problems/smoother/flight_problem.h"

namespace trueline {

struct Strengths {
  VgdOptions vgd;  // with the strengths' root mean squares
  std::vector<LearnedStrength> learned;
  // False if the search ended before it settled: the values are the last ones tried.
  bool converged = true;
};

// Maximises the marginal likelihood (Laplace's approximation over all states and parameters) over
// the logarithms of process.tilt, process.acceleration across and along the thrust and, where the
// accelerometer measures drag, process.gust and the forces' scale. Intervals
// come from the curvature. The priors of the logarithms have a sigma of a factor of three. Uses the
// first `seconds` of each flight.
Strengths LearnStrengths(const std::vector<FlightShare>& flights,
                         const FlightProblemOptions& options, double seconds);

}  // namespace trueline
