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
// with it. That one of two passes saw something else than its gate is allowed for: it would
// otherwise pass for drift.
class DriftStrength {
 public:
  // Before any evidence the candidates spread around options.process.tilt.
  explicit DriftStrength(const VgdOptions& options);

  // Takes in the passes up to `tau` (from 1); to be called for each pass in turn.
  void Learn(const FlightData& flight, int tau);

  // The most probable candidate, rad.
  double Tilt() const;

 private:
  struct Fit {
    double cost;
    double log_evidence;
  };
  Fit Solve(const FlightData& flight, const WindowData& data, double tilt);

  VgdOptions options_;
  std::vector<double> candidates_;       // rad
  std::vector<double> log_probability_;  // up to a constant
};

// The tilt's sigma for the window that ends with pass tau (index tau - 1), each learned from the
// flight up to there. The same for every window length and every order of windows, so it is learned
// once for all of them. options.process.tilt throughout where options.adapt_drift is off.
std::vector<double> LearnTilts(const FlightData& flight, const VgdOptions& options);

}  // namespace trueline
