#include "problems/vgd/vgd.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/random.h"
#include "problems/vgd/drift_strength.h"
#include "problems/vgd/identifiability.h"
#include "problems/vgd/window_data.h"
#include "problems/window/rough_path.h"

namespace trueline {
namespace {

using Parameters = Eigen::Matrix<double, WindowProblem::kParameters, 1>;

std::vector<std::string> ParameterNames(bool with_forces) {
  std::vector<std::string> names(kImuDrivenNames.begin(), kImuDrivenNames.end());
  if (with_forces) names.insert(names.end(), {"b_ax", "b_ay"});
  return names;
}

std::vector<std::string> ParameterUnits(bool with_forces) {
  std::vector<std::string> units(kImuDrivenUnits.begin(), kImuDrivenUnits.end());
  if (with_forces) units.insert(units.end(), {"m/s^2", "m/s^2"});
  return units;
}

double RobustWeight(const VgdOptions& options, const Eigen::Vector3d& whitened) {
  const double norm = whitened.norm(), scale = options.loss_scale;
  switch (options.loss) {
    case FixLoss::kHuber:
      return norm > scale ? scale / norm : 1.0;
    case FixLoss::kCauchy:
      return 1.0 / (1.0 + norm * norm / (scale * scale));
    case FixLoss::kNorm:
      return 1.0 / std::max(norm, 1e-3);
    case FixLoss::kNone:
      break;
  }
  return 1.0;
}

void StoreMisfits(const WindowProblem& problem, const WindowData& data, const VgdOptions& options,
                  WindowEstimate* estimate) {
  for (const Fix& fix : data.fixes) {
    const Eigen::Vector3d error = problem.PositionAt(fix.t) - fix.p_E;
    const double sigma = options.whiten ? fix.sigma : 1.0;
    estimate->misfits.push_back(
        {fix.t, fix.gate, error, fix.sigma, RobustWeight(options, error / sigma)});
  }
}

void StoreTrajectory(const WindowProblem& problem, TimeNs pass_begin, TimeNs pass_end,
                     WindowEstimate* estimate) {
  for (const auto& segment : problem.segments()) {
    for (const TimeNs t : segment->times()) {
      if (t < pass_begin) continue;
      const auto& x = segment->StateAt(t)->value;
      auto& points = t <= pass_end ? estimate->fitted : estimate->predicted;
      points.push_back({t, x.head<3>(), x.tail<3>()});
    }
  }
}

void StoreParameters(const VgdOptions& options, WindowProblem* problem,
                     const Eigen::MatrixXd& cov_all, WindowEstimate* estimate) {
  const int count = problem->HasForces() ? WindowProblem::kParameters : 9;
  const auto names = ParameterNames(count > 9), units = ParameterUnits(count > 9);
  const Parameters value = problem->Parameters();
  Eigen::VectorXd sigma_prior(WindowProblem::kParameters);
  for (int i = 0; i < 9; ++i) sigma_prior[i] = options.priors[i].sigma;
  sigma_prior.tail<2>().setConstant(options.drag_measurement.bias_sigma);
  const Identifiability identifiability =
      AnalyseIdentifiability(names, units, sigma_prior.head(count),
                             cov_all.topLeftCorner(count, count));
  estimate->unobservable = identifiability.combinations;
  for (int i = 0; i < count; ++i) {
    std::string status = identifiability.status[i];
    if (i < 9) {
      const ParameterPrior& prior = options.priors[i];
      const double margin = 1e-6 * prior.sigma;
      if (value[i] < prior.lower + margin || value[i] > prior.upper - margin) status = "at_bound";
    }
    const double sigma = sigma_prior[i] * std::sqrt(cov_all(i, i));
    estimate->parameters.push_back({names[i], value[i], sigma, units[i], status});
  }
}

void StoreArc(const FlightData& flight, int tau, const WindowProblem& problem,
              const Eigen::MatrixXd& cov_all, WindowEstimate* estimate) {
  ArcPrediction arc = flight.ArcAfter(tau);
  arc.p_E = problem.FinalState().head<2>();
  arc.cov = cov_all.block<2, 2>(WindowProblem::kParameters, WindowProblem::kParameters);
  estimate->arc = arc;
}

Theta ThetaOf(const WindowEstimate& estimate) {
  Theta theta;
  for (int i = 0; i < 9; ++i) theta[i] = estimate.parameters[i].value;
  return theta;
}

}  // namespace

Theta PriorMeans(const VgdOptions& options) {
  Theta theta;
  for (int i = 0; i < 9; ++i) theta[i] = options.priors[i].mean;
  return theta;
}

WindowEstimate SolveWindow(const FlightData& flight, const VgdOptions& options, int tau,
                           const Theta& start) {
  const int first = FirstPassOf(flight, options, tau);
  const Pass& to = flight.passes[tau - 1];
  const WindowData data = CutWindow(flight, options, first, tau, true);
  WindowProblem problem(flight.track, data, options);
  problem.SetStart(start, RoughPath(flight.log.fixes, std::span(flight.passes).subspan(first, tau - first)));
  const ceres::Solver::Summary summary = problem.Solve();

  WindowEstimate estimate;
  estimate.tau = tau;
  estimate.gamma = tau - first;
  estimate.begin = data.begin;
  estimate.end = to.end;
  estimate.iterations = static_cast<int>(summary.iterations.size()) - 1;
  estimate.converged = summary.termination_type == ceres::CONVERGENCE;
  estimate.cost = summary.final_cost;
  const Eigen::MatrixXd cov = problem.Covariance();
  StoreParameters(options, &problem, cov, &estimate);
  StoreMisfits(problem, data, options, &estimate);
  StoreTrajectory(problem, to.begin, to.end, &estimate);
  if (flight.HasArc(tau)) StoreArc(flight, tau, problem, cov, &estimate);
  estimate.solve_time = summary.total_time_in_seconds;
  return estimate;
}

EstimatorRun RunVgd(const FlightData& flight, const VgdOptions& options) {
  EstimatorRun run{"vgd", options.gamma, {}, flight.warnings};
  VgdOptions adapted = options;
  DriftStrength drift(options);
  Theta start = PriorMeans(options);
  for (int tau = 1; tau <= static_cast<int>(flight.passes.size()); ++tau) {
    if (options.adapt_drift && options.process.tilt > 0.0) {
      drift.Learn(flight, tau, start);
      adapted.process.tilt = drift.Tilt();
    }
    run.windows.push_back(SolveWindow(flight, adapted, tau, start));
    if (run.windows.back().converged) start = ThetaOf(run.windows.back());
    const bool last = tau == static_cast<int>(flight.passes.size());
    if (!last && !run.windows.back().arc) {
      run.warnings.push_back(fmt::format(
          "the arc after pass {} (at {:.2f} s) is not predicted: it lasts over {} s, or the IMU has "
          "a gap in it",
          tau, SecondsBetween(flight.track.begin(), flight.passes[tau - 1].end),
          flight.pass_options.max_arc));
    }
  }
  return run;
}

StartStudy StudyStarts(const FlightData& flight, const VgdOptions& options, int tau, int count,
                       std::uint64_t seed) {
  Random random(seed, "starts");
  std::vector<WindowEstimate> estimates;
  for (int k = 0; k < count; ++k) {
    Theta start;
    for (int i = 0; i < 9; ++i) {
      const ParameterPrior& prior = options.priors[i];
      start[i] = prior.mean + prior.sigma * random.Uniform(-1.0, 1.0);
    }
    estimates.push_back(SolveWindow(flight, options, tau, start));
  }
  const auto best = std::min_element(
      estimates.begin(), estimates.end(),
      [](const WindowEstimate& a, const WindowEstimate& b) { return a.cost < b.cost; });
  StartStudy study;
  study.starts = count;
  for (const WindowEstimate& estimate : estimates) {
    bool same = true;
    for (std::size_t i = 0; i < estimate.parameters.size(); ++i) {
      const double difference = estimate.parameters[i].value - best->parameters[i].value;
      same = same && std::abs(difference) <= 0.1 * best->parameters[i].sigma;
    }
    study.same_optimum += same;
    study.iterations.push_back(estimate.iterations);
    study.costs.push_back(estimate.cost);
  }
  return study;
}

}  // namespace trueline
