#include "problems/vgd/vgd.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/trajectory/mocap_path.h"
#include "problems/vgd/rough_path.h"
#include "problems/vgd/window_estimate.h"
#include "problems/vgd/window_problem.h"

namespace trueline {

Theta PriorMeans(const VgdOptions& options) {
  Theta theta;
  for (int i = 0; i < kMotionSize; ++i) theta[i] = options.priors[i].mean;
  return theta;
}

Theta RandomStart(const VgdOptions& options, Random* random) {
  Theta start;
  for (int i = 0; i < kMotionSize; ++i) {
    const ParameterPrior& prior = options.priors[i];
    const double half_range = std::sqrt(3.0) * prior.sigma;  // of the uniform distribution
    start[i] = prior.mean + half_range * random->Uniform(-1.0, 1.0);
  }
  return start;
}

WindowEstimate SolveWindow(const FlightData& flight, const VgdOptions& options, int tau,
                           const Theta& start) {
  const int first = flight.FirstPassOf(tau, options.gamma, options.min_window_fixes);
  const WindowData data = CutWindow(flight, options, first, tau, true);
  WindowProblem problem(flight.track, data, options);
  problem.SetStart(start, RoughPath(flight.log.fixes, data.passes));
  const ceres::Solver::Summary summary = problem.Solve();

  return DescribeWindow(flight, options, data, tau, summary, &problem);
}

EstimatorRun RunVgd(const FlightData& flight, const VgdOptions& options) {
  return RunVgd(flight, options, LearnProcess(flight, options));
}

EstimatorRun RunVgd(const FlightData& flight, const VgdOptions& options,
                    const std::vector<ProcessNoise>& processes) {
  EstimatorRun run{"vgd", options.gamma, {}, flight.warnings};
  VgdOptions adapted = options;
  Theta start = PriorMeans(options);
  Random random(options.start_seed, "window starts");
  for (int tau = 1; tau <= static_cast<int>(flight.passes.size()); ++tau) {
    adapted.process = processes[tau - 1];
    if (options.start == SearchStart::kRandom) start = RandomStart(options, &random);
    run.windows.push_back(SolveWindow(flight, adapted, tau, start));
    const bool follows = options.start == SearchStart::kPrevious && run.windows.back().converged;
    if (follows) start = ThetaOf(run.windows.back());
    const bool last = tau == static_cast<int>(flight.passes.size());
    if (!last && !run.windows.back().arc) {
      run.warnings.push_back(flight.NoArcReason(tau));
    }
  }
  if (flight.continuous) WidenByScatter(options, &run);
  return run;
}

StartStudy StudyStarts(const FlightData& flight, const VgdOptions& options, int tau, int count,
                       std::uint64_t seed) {
  Random random(seed, "starts");
  VgdOptions thorough = options;
  thorough.tolerance = 1e-12;
  thorough.max_iterations = 200;
  StartStudy study;
  study.starts = count;
  std::vector<WindowEstimate> estimates;
  for (int k = 0; k < count; ++k) {
    const Theta start = RandomStart(options, &random);
    study.iterations.push_back(SolveWindow(flight, options, tau, start).iterations);
    estimates.push_back(SolveWindow(flight, thorough, tau, start));
    study.costs.push_back(estimates.back().cost);
  }
  const auto best = std::min_element(
      estimates.begin(), estimates.end(),
      [](const WindowEstimate& a, const WindowEstimate& b) { return a.cost < b.cost; });
  for (const WindowEstimate& estimate : estimates) {
    bool same = true;
    for (std::size_t i = 0; i < estimate.parameters.size(); ++i) {
      const double difference = estimate.parameters[i].value - best->parameters[i].value;
      same = same && std::abs(difference) <= 0.1 * best->parameters[i].sigma;
    }
    study.same_optimum += same;
  }
  return study;
}

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
