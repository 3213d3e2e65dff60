#include "problems/experiment/accuracy.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/kinematic_model.h"
#include "problems/simulation/config.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd.h"

namespace trueline {
namespace {

std::vector<TimedError> ArcErrors(const EstimatorRun& run, TimeNs origin) {
  std::vector<TimedError> errors;
  for (const WindowEstimate& window : run.windows) {
    if (!window.arc || !window.arc->truth) continue;
    errors.push_back({SecondsBetween(origin, window.arc->end), window.arc->FinalPointError()});
  }
  return errors;
}

std::vector<TimedError> ParameterErrors(const EstimatorRun& run, const std::string& name,
                                        double truth, TimeNs origin) {
  std::vector<TimedError> errors;
  for (const WindowEstimate& window : run.windows) {
    for (const ParameterEstimate& p : window.parameters) {
      if (p.name != name) continue;
      errors.push_back({SecondsBetween(origin, window.end), p.value - truth});
    }
  }
  return errors;
}

}  // namespace

std::map<std::string, double> TrueParameters(const SimulationTruth& truth) {
  std::map<std::string, double> parameters = TunableValues(truth.config);
  for (int i = 0; i < 3; ++i) parameters[kTheta[kAhrsInTheta + i].name] = truth.ahrs_error_mean[i];
  return parameters;
}

std::vector<std::string> ParametersWithTruth() {
  std::vector<std::string> names;
  for (int i = 0; i < kStatedSize; ++i) names.push_back(kTheta[i].name);
  for (const char* name : kImuBiasNames) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

double TimeInside(const std::vector<TimedError>& errors, double tolerance) {
  double time = std::numeric_limits<double>::quiet_NaN();
  for (const TimedError& error : errors) {
    const bool inside = std::abs(error.error) <= tolerance;  // false for NaN
    if (!inside) time = std::numeric_limits<double>::quiet_NaN();
    if (inside && std::isnan(time)) time = error.time;
  }
  return time;
}

std::vector<ConvergenceRow> Convergence(const EstimatorRun& run, const std::string& label,
                                        const std::map<std::string, double>& truth,
                                        const std::map<std::string, double>& tolerances,
                                        TimeNs first_fix) {
  std::vector<ConvergenceRow> rows;
  for (const auto& [quantity, tolerance] : tolerances) {
    std::vector<TimedError> errors;
    if (quantity == kFinalPointError) {
      errors = ArcErrors(run, first_fix);
    } else if (const auto known = truth.find(quantity); known != truth.end()) {
      errors = ParameterErrors(run, quantity, known->second, first_fix);
    }
    if (errors.empty()) continue;
    rows.push_back({label, run.gamma, quantity, tolerance, static_cast<int>(errors.size()),
                    TimeInside(errors, tolerance)});
  }
  return rows;
}

Eigen::Matrix2d FinalPointBound(const FlightData& flight, const VgdOptions& options, int tau,
                                const std::optional<Theta>& theta) {
  CHECK(flight.HasArc(tau)) << "no arc follows that pass";
  VgdOptions exact = options;
  exact.loss = FixLoss::kNone;
  exact.whiten = true;
  exact.solver = VgdSolver::kTrustRegion;
  const int first = flight.FirstPassOf(tau, options.gamma, options.min_window_fixes);
  const auto passes = std::span(flight.passes).subspan(first, tau - first);
  WindowProblem problem(flight.track, CutWindow(flight, exact, first, tau, true), exact);
  problem.SetStart(theta.value_or(PriorMeans(exact)), RoughPath(flight.log.fixes, passes));
  // The information depends on the path only weakly (through drag); the path is fitted.
  problem.HoldParameters(theta.has_value());
  problem.Solve();
  problem.HoldParameters(false);
  constexpr int kFinal = WindowProblem::kParameters;
  return problem.Covariance().block<2, 2>(kFinal, kFinal);
}

double LeastFinalPointError(const Eigen::Matrix2d& bound) { return std::sqrt(bound.trace()); }

}  // namespace trueline
