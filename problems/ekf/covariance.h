// Propagation of the filter's covariance (Li et al. 2019, eq. 24-25).
#pragma once

#include "problems/ekf/nav_state.h"

namespace trueline {

// F P F' with the transition's blocks of zero and identity left out; about a quarter of the
// dense product's operations.
Matrix15d PropagateSparse(const Transition& F, const Matrix15d& P);

// The same by two full products.
Matrix15d PropagateDense(const Transition& F, const Matrix15d& P);

// Covariance that white noise of accelerometer and gyroscope and random walks of the biases add
// over the step: the integral of exp(A s) G S G' exp(A s)' ds, to the leading order of each block.
Matrix15d StepNoise(const Transition& F, const ImuNoise& noise);

// The paper's Q: constant variances for each sample at its rate, for any dt.
Matrix15d PaperStepNoise(const EkfOptions& options, double dt);

}  // namespace trueline
