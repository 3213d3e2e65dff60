// Strengths of the AHRS drift and of gusts, learned from the flight.
#pragma once

#include <vector>

#include "problems/vgd/flight_data.h"

namespace trueline {

// Empirical Bayes over a grid of hypotheses for the stationary sigmas of tilt and gust, and beside
// the most probable of these for the unmodelled acceleration along the thrust. The log
// evidence (marginal likelihood, by Laplace's approximation) of every arc between two passes is
// summed as the flight goes on, so a prediction uses past flight only. A fixed sigma would be too
// wide for some vehicles and too narrow for others, and so would the stated uncertainty. The
// evidence includes the hypothesis that one of the passes is false; its offset would otherwise be
// attributed to drift.
class ProcessLearner {
 public:
  // Without evidence the hypotheses' prior is centred on options.process.
  explicit ProcessLearner(const VgdOptions& options);

  // Adds the evidence of the passes up to `tau` (from 1); call it for each pass in turn.
  void Learn(const FlightData& flight, int tau);

  // The most probable hypothesis.
  const ProcessNoise& Process() const { return MostProbable(hypotheses_).process; }

 private:
  struct Hypothesis {
    ProcessNoise process;
    double log_probability;  // up to a constant
  };
  struct Fit {
    double cost;
    double log_evidence;
  };
  Fit Solve(const FlightData& flight, const WindowData& data, const ProcessNoise& process);
  // Adds the evidence of a stretch to each hypothesis that is not rejected. False if the stretch
  // fits none of them.
  bool AddEvidence(const FlightData& flight, WindowData data, std::vector<Hypothesis>* hypotheses);
  static std::vector<Hypothesis*> Contenders(std::vector<Hypothesis>* hypotheses);
  static const Hypothesis& MostProbable(const std::vector<Hypothesis>& hypotheses);

  VgdOptions options_;
  std::vector<Hypothesis> hypotheses_;  // of tilt and gust, with the best factor along the thrust
  std::vector<Hypothesis> thrusts_;     // of that factor, with the best tilt and gust
};

// For each pass tau the process (index tau - 1) of the window that ends there, learned from the
// flight up to it. It does not depend on the window's length, so it is learned once for all
// estimators. options.process throughout if options.adapt_drift is off.
std::vector<ProcessNoise> LearnProcess(const FlightData& flight, const VgdOptions& options);

}  // namespace trueline
