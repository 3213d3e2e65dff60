// The time from which an estimate stays near the truth.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/experiment/rows.h"
#include "problems/result/estimate.h"
#include "problems/simulation/simulate.h"

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

}  // namespace trueline
