// How strongly this vehicle's AHRS drifts, learned from the flight itself.
#pragma once

#include <vector>

#include "problems/vgd/window_problem.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Empirical Bayes over a few candidates for the stationary sigma of the tilt drift. The evidence
// (marginal likelihood, by Laplace's approximation) of every second pass with its neighbour is
// added up as the flight goes on, so that a prediction rests on past flight only. One sigma for
// all vehicles would be too wide for some and too narrow for others, and the stated uncertainty
// with it.
class DriftStrength {
 public:
  // Before any evidence the candidates spread around options.process.tilt.
  explicit DriftStrength(const VgdOptions& options);

  // Takes in the passes up to `tau` (from 1); to be called for each pass in turn.
  void Learn(const FlightData& flight, int tau, const Theta& start);

  // The most probable candidate, rad.
  double Tilt() const;

 private:
  VgdOptions options_;
  std::vector<double> candidates_;       // rad
  std::vector<double> log_probability_;  // up to a constant
};

}  // namespace trueline
