// The base fit: the calibrated model over the whole flight with its nuisances, and the strengths of
// what it leaves out, by evidence.
#pragma once

#include "problems/diagnosis/chain_system.h"

namespace trueline {

// A solved flight: rows linearised at the solution, ready for candidates to be tested against.
struct BaseFit {
  FlightUnknowns x;
  NoiseStrengths noise;
  Eigen::VectorXd weight;  // by measurement row, root of the robust weight
  Columns columns;         // nuisances and the effects in the model, at their values
  FlightRows rows;         // at x, columns included

  LinearFlight Linear(const BaseFlight& flight) const { return {flight, rows, x, weight, columns}; }
};

// Gauss-Newton over all unknowns from `fit.x`; `fit.columns` and `fit.noise` are taken as given,
// the columns' values are part of the solution. Robust weights are Huber's, renewed at each step.
void Solve(BaseFlight* flight, int max_iterations, BaseFit* fit);

// Strengths that make the flight most probable (empirical Bayes), by a search along the coordinates
// of their logarithms from where `fit` has them; weak priors keep them near what is ordinary. The
// first kThetaSize + `nuisances` border unknowns are integrated out. Returns the log evidence with
// those priors.
double LearnNoise(const LinearFlight& linear, int nuisances, int sweeps, NoiseStrengths* noise);

// Where the strengths start: the options' process noise, detector's sigmas as stated.
NoiseStrengths StartingNoise(const VgdOptions& options);

}  // namespace trueline
