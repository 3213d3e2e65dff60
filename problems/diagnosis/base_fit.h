// The base fit: the calibrated model over the whole flight with nuisance processes, whose strengths
// are learned by evidence.
#pragma once

#include "problems/diagnosis/chain_system.h"

namespace trueline {

// A solved flight, linearised at the solution. Candidates are tested against it.
struct BaseFit {
  FlightUnknowns x;
  NoiseStrengths noise;
  Eigen::VectorXd weight;  // of each measurement row, root of the robust weight
  Columns columns;         // nuisances and the effects in the model, at their values
  FlightRows rows;         // at x, columns included

  LinearFlight Linear(const BaseFlight& flight) const { return {flight, rows, x, weight, columns}; }
};

// Damped Gauss-Newton over all unknowns and the columns' values, from `fit.x`; the columns' slopes
// and `fit.noise` are held. Each step lowers the cost. The robust (Huber) weights are updated at
// each step.
void Solve(BaseFlight* flight, int max_iterations, BaseFit* fit);

// The strengths of the greatest marginal likelihood (empirical Bayes): a coordinate search over
// their logarithms from `fit`'s values, with weak priors around ordinary values. The first
// kThetaSize + `nuisances` border unknowns are integrated out. Returns the log evidence, priors
// included.
double LearnNoise(const LinearFlight& linear, int nuisances, int sweeps, NoiseStrengths* noise);

struct LearnedStrengths {
  NoiseStrengths noise;
  double evidence;  // as LearnNoise returns it
};

// The strengths that each set of columns learns from `from`, by one Newton step in their
// logarithms. The points of the parabola are the same for all sets, so that one elimination with
// all columns serves them all. Learned noise may hide a real effect and is then far from that of
// the right candidate: a second step starts at the attitude's drift that ordinary flights have, and
// the better end counts.
std::vector<LearnedStrengths> LearnNoiseOfEach(const LinearFlight& linear, int nuisances,
                                               const std::vector<std::vector<int>>& sets,
                                               const NoiseStrengths& from);

// Initial strengths: the options' process noise, and the detector's sigmas as stated.
NoiseStrengths StartingNoise(const VgdOptions& options);

}  // namespace trueline
