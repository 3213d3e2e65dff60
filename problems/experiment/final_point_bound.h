// The Cramer-Rao bound of the final-point error: a lower bound for any unbiased estimator of the
// same model.
#pragma once

#include <optional>

#include "problems/vgd/flight_data.h"
#include "problems/vgd/window_problem.h"

namespace trueline {

// Bound covariance (m^2) of the horizontal final point of the arc after pass `tau` (from 1), which
// must exist (FlightData::HasArc), for a window of options.gamma passes. It is the inverse of the
// Fisher information of eq. 15, with the fixes' own sigmas, options.process as nuisance states and
// options.priors as prior information (the Bayesian bound of Van Trees). For the paper's rigid
// model set process to zero. The robust loss is ignored: with outliers the bound is that of the
// flight without them.
//
// The linearisation point is `theta` (eq. 16) where the truth is known, else the fit.
Eigen::Matrix2d FinalPointBound(const FlightData& flight, const VgdOptions& options, int tau,
                                const std::optional<Theta>& theta);

// Least root mean square of the final-point error (eq. 34-35) under that covariance, m.
double LeastFinalPointError(const Eigen::Matrix2d& bound);

}  // namespace trueline
