#include "problems/vgd/window_estimate.h"

#include <cmath>

#include "problems/result/identifiability.h"
#include "problems/vgd/solver_options.h"

namespace trueline {
namespace {

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

// The sigmas that a status refers to: the ranges of Table 2, or the prior's where that is wider. A
// tight prior from an earlier flight (--model) must not make a parameter look unobservable.
Eigen::VectorXd ReferenceSigma(const Eigen::VectorXd& prior_sigma) {
  const VgdOptions table_2;
  Eigen::VectorXd sigma = prior_sigma;
  for (int i = 0; i < kMotionSize; ++i) sigma[i] = std::max(sigma[i], table_2.priors[i].sigma);
  return sigma;
}

// The weights of the prior that the window had, by parameter.
Eigen::VectorXd PriorWeights(const VgdOptions& options, Eigen::Index count) {
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(count);
  weight.head<kMotionSize>().setConstant(WindowProblem::PriorWeight(options));
  return weight;
}

// cov: in units of prior_sigma. Returns the covariance that the same data give under the reference
// prior, in units of the reference; both contain the data's information, inv(cov) - weight^2.
Eigen::MatrixXd UnderReference(const Eigen::MatrixXd& cov, const Eigen::VectorXd& weight,
                               const Eigen::VectorXd& prior_sigma,
                               const Eigen::VectorXd& reference) {
  const auto I = Eigen::MatrixXd::Identity(cov.rows(), cov.cols());
  if (reference == prior_sigma && (weight.array() == 1.0).all()) return cov;
  const Eigen::VectorXd scale = reference.cwiseQuotient(prior_sigma);
  Eigen::MatrixXd information = cov.inverse();
  information.diagonal() -= weight.cwiseAbs2();
  information = scale.asDiagonal() * information * scale.asDiagonal();
  return (information + I).inverse();
}

void StoreParameters(const VgdOptions& options, WindowProblem* problem,
                     const WindowProblem::Uncertainty& uncertainty, double force_sigma,
                     WindowEstimate* estimate) {
  const int count = problem->HasForces() ? kStatedSize : kMotionSize;
  const Eigen::VectorXd fitted = problem->Parameters().head(count);
  std::vector<std::string> names(count), units(count);
  Eigen::VectorXd prior(count), mean(count);
  for (int i = 0; i < count; ++i) {
    names[i] = kTheta[i].name;
    units[i] = kTheta[i].unit;
    prior[i] = options.PriorOf(i).sigma;
    mean[i] = options.PriorOf(i).mean;
  }
  const Eigen::VectorXd reference = ReferenceSigma(prior);
  const bool without_prior = options.ranges != RangeUse::kPrior;
  Eigen::MatrixXd cov = uncertainty.cov.topLeftCorner(count, count);
  Eigen::MatrixXd shown = UnderReference(cov, PriorWeights(options, count), prior, reference);
  const Eigen::MatrixXd model_cov = cov;
  WidenDrag(uncertainty.drag_errors, options, force_sigma, prior, &cov);
  const Eigen::VectorXd deviation = (fitted - mean).cwiseQuotient(prior);
  const Eigen::VectorXd value =
      mean + prior.cwiseProduct(ReturnDrag(options, model_cov, cov, deviation));
  WidenDrag(uncertainty.drag_errors, options, force_sigma, reference, &shown);
  const Identifiability identifiability = AnalyseIdentifiability(names, units, reference, shown);
  estimate->unobservable = identifiability.combinations;
  for (int i = 0; i < count; ++i) {
    std::string status = identifiability.status[i];
    const bool bounded = options.ranges != RangeUse::kStart;
    if (bounded && AtBound(options.PriorOf(i), fitted[i])) status = "at_bound";
    const double sigma = prior[i] * std::sqrt(cov(i, i));
    // Without a prior the estimate is no better than its own sigma, whatever a prior would add.
    const bool judged = status == "identified" || status == "weak";
    if (without_prior && judged && sigma > 0.5 * reference[i]) {
      status = sigma > reference[i] ? "unobservable" : "weak";
    }
    const double model_sigma = prior[i] * std::sqrt(model_cov(i, i));
    estimate->parameters.push_back({names[i], value[i], sigma, units[i], status, model_sigma});
  }
}

void StoreArc(const FlightData& flight, int tau, const WindowProblem& problem,
              const Eigen::MatrixXd& cov_all, WindowEstimate* estimate) {
  ArcPrediction arc = flight.ArcAfter(tau);
  arc.p_E = problem.FinalState().head<2>();
  arc.cov = cov_all.block<2, 2>(kThetaSize, kThetaSize);
  estimate->arc = arc;
}

}  // namespace

Theta ThetaOf(const WindowEstimate& estimate) {
  Theta theta;
  for (int i = 0; i < kMotionSize; ++i) theta[i] = estimate.parameters[i].value;
  return theta;
}

WindowEstimate DescribeWindow(const FlightData& flight, const VgdOptions& options,
                              const WindowData& data, int tau,
                              const ceres::Solver::Summary& summary, WindowProblem* problem) {
  WindowEstimate estimate;
  estimate.tau = tau;
  estimate.gamma = static_cast<int>(data.passes.size());
  estimate.begin = data.begin;
  estimate.end = data.passes.back().end;
  estimate.iterations = static_cast<int>(summary.iterations.size()) - 1;
  estimate.converged = summary.termination_type == ceres::CONVERGENCE;
  estimate.cost = summary.final_cost;
  const WindowProblem::Uncertainty uncertainty = problem->FindUncertainty();
  StoreParameters(options, problem, uncertainty, data.force_sigma, &estimate);
  const auto position_at = [&](TimeNs t) { return problem->PositionAt(t); };
  StoreMisfits(data.fixes, options, position_at, &estimate);
  StoreTrajectory(*problem, data.passes.back().begin, data.passes.back().end, &estimate);
  if (flight.HasArc(tau)) StoreArc(flight, tau, *problem, uncertainty.cov, &estimate);
  if (const auto delay = problem->FixLatency()) {
    const bool shown = delay->sigma < 0.5 * data.noise.latency_sigma;
    estimate.fix_latency = {"fix_latency", delay->value, delay->sigma, "s",
                            shown ? "identified" : "weak"};
  }
  estimate.solve_time = summary.total_time_in_seconds;
  return estimate;
}

}  // namespace trueline
