// How near an estimate is to the truth: the time from which it stays near, and the least error of
// the final point that any unbiased estimator of the same model has (Cramer-Rao bound).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/experiment/rows.h"
#include "problems/result/estimate.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/window_problem.h"

namespace trueline {

// Parameters of a simulated flight by the names that estimators use, in SI: K_x ... of eq. 16, and
// b_ax, b_ay, b_gx, b_gy, b_gz. A varying AHRS error is given by its mean.
std::map<std::string, double> TrueParameters(const SimulationTruth& truth);

// The quantity of arcs; all others are parameters.
inline constexpr const char* kFinalPointError = "final_point_error";

// Names of the parameters that an estimator gives and whose truth a simulated flight knows.
std::vector<std::string> ParametersWithTruth();

// An error and the time at which it became known.
struct TimedError {
  double time;   // s
  double error;  // of any sign
};

// The first time from which all errors are within +-tolerance; NaN if the last one is not, or if
// there are no errors.
double TimeInside(const std::vector<TimedError>& errors, double tolerance);

// One row for each quantity of `tolerances` that the run gives: a parameter with a known truth
// (known at the end of each window's last pass), or final_point_error (at the end of each arc).
// Times count from `first_fix`.
std::vector<ConvergenceRow> Convergence(const EstimatorRun& run, const std::string& label,
                                        const std::map<std::string, double>& truth,
                                        const std::map<std::string, double>& tolerances,
                                        TimeNs first_fix);

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
