#include "problems/experiment/final_point_bound.h"

#include <glog/logging.h>

#include <cmath>

#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd.h"

namespace trueline {

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
