// How strongly this vehicle's AHRS drifts and how strong gusts are, learned from the flight itself.
#pragma once

#include <vector>

#include "problems/vgd/window_problem.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Empirical Bayes over a grid of candidates for the stationary sigmas of tilt and gust. The
// evidence (marginal likelihood, by Laplace's approximation) of every arc between two passes is
// added up as the flight goes on, so that a prediction rests on past flight only. One sigma for all
// vehicles would be too wide for some and too narrow for others, and the stated uncertainty with
// it. That one of the passes saw something else than its gate is allowed for: it
// would otherwise pass for drift.
class ProcessLearner {
 public:
  // Before any evidence the candidates spread around options.process.
  explicit ProcessLearner(const VgdOptions& options);

  // Takes in the passes up to `tau` (from 1); to be called for each pass in turn.
  void Learn(const FlightData& flight, int tau);

  // The most probable candidate.
  const ProcessNoise& Process() const;

 private:
  struct Candidate {
    ProcessNoise process;
    double log_probability;  // up to a constant
  };
  struct Fit {
    double cost;
    double log_evidence;
  };
  Fit Solve(const FlightData& flight, const WindowData& data, const ProcessNoise& process);
  std::vector<Candidate*> Contenders();

  VgdOptions options_;
  std::vector<Candidate> candidates_;
};

// The process for the window that ends with pass tau (index tau - 1), each learned from the flight
// up to there. The same for every window length and every order of windows, so it is learned once
// for all of them. options.process throughout where options.adapt_drift is off.
std::vector<ProcessNoise> LearnProcess(const FlightData& flight, const VgdOptions& options);

}  // namespace trueline
