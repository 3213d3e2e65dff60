#include "problems/vgd/forecast.h"

#include <Eigen/Dense>
#include <cmath>

#include "problems/trajectory/mocap_path.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/rough_path.h"
#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

Forecast ForecastAt(const FlightData& flight, const VgdOptions& options, int tau,
                    const Theta& start, double horizon, const Eigen::Vector3d& truth) {
  const int first = flight.FirstPassOf(tau, options.gamma, options.min_window_fixes);
  const TimeNs end = flight.passes[tau - 1].end + FromSeconds(horizon);
  const WindowData data = CutWindowUntil(flight, options, first, tau, end);
  WindowProblem problem(flight.track, data, options);
  problem.SetStart(start, RoughPath(flight.log.fixes, data.passes));
  problem.Solve();
  const Eigen::Matrix2d cov = problem.Covariance().block<2, 2>(kThetaSize, kThetaSize);
  const Eigen::Vector2d error = problem.FinalState().head<2>() - truth.head<2>();
  return {horizon, error.norm(), std::sqrt(0.5 * cov.trace()),
          1.0 - std::exp(-0.5 * error.dot(cov.inverse() * error))};
}

}  // namespace

std::vector<Forecast> ForecastAfter(const FlightData& flight, const VgdOptions& options, int tau,
                                    const Theta& start, const std::vector<double>& horizons) {
  // Correlated fixes give positions against the last fix, as late as those are.
  const bool relative = flight.continuous && flight.continuous->noise.IsCorrelated();
  if (!flight.HasArc(tau) || relative) return {};
  std::vector<Forecast> forecasts;
  for (const double horizon : horizons) {
    const TimeNs end = flight.passes[tau - 1].end + FromSeconds(horizon);
    if (end > flight.passes[tau].begin) continue;
    const auto truth = PositionAt(flight.log.mocap, end, kLongestMocapGap);
    if (truth) forecasts.push_back(ForecastAt(flight, options, tau, start, horizon, *truth));
  }
  return forecasts;
}

}  // namespace trueline
