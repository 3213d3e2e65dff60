#include "problems/vgd/window_estimate.h"

#include <algorithm>
#include <cmath>

#include "problems/result/identifiability.h"

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

namespace {

constexpr double kExpected = 2.0;  // windows that an expectation of one counts as
// Share of the variance that the prior takes at most. Where the data say nothing, every window
// repeats the prior's mean, and its scatter is nothing divided by nothing.
constexpr double kMostByPrior = 0.95;

using Estimates = std::vector<std::vector<ParameterEstimate>>;  // by window and parameter

// The variance with which a window's estimate scatters about the truth: the prior draws it to its
// mean, so it scatters by less than its sigma.
double VarianceOfScatter(double sigma, double prior_sigma) {
  const double by_prior = std::min(kMostByPrior, std::pow(sigma / prior_sigma, 2));
  return sigma * sigma * (1.0 - by_prior);
}

// Indices of the window and of those before it that share no pass with each other. A window reaches
// further back than gamma passes where these hold too few fixes, so its own count tells where the
// next may end. Windows of fewer passes, at the flight's start, are left out.
std::vector<std::size_t> DisjointWindows(const std::vector<WindowEstimate>& windows,
                                         std::size_t window, int gamma) {
  std::vector<std::size_t> indices{window};
  for (std::size_t i = window; i-- > 0;) {
    const WindowEstimate& after = windows[indices.back()];
    const bool is_before = windows[i].tau <= after.tau - after.gamma;
    if (is_before && windows[i].gamma >= gamma) indices.push_back(i);
  }
  return indices;
}

// The factor on the sigma of parameter `p` by the scatter of these windows; at least 1.
double Factor(const Estimates& estimates, const std::vector<std::size_t>& windows, std::size_t p,
              double prior_sigma) {
  double weights = 0.0, mean = 0.0, squares = 0.0;
  for (const std::size_t i : windows) {
    const ParameterEstimate& estimate = estimates[i][p];
    const double weight = 1.0 / VarianceOfScatter(estimate.sigma, prior_sigma);
    weights += weight;
    const double off = estimate.value - mean;
    mean += off * weight / weights;
    squares += weight * off * (estimate.value - mean);
  }
  const double others = static_cast<double>(windows.size()) - 1.0;
  return std::sqrt(std::max(1.0, (kExpected + squares) / (kExpected + others)));
}

// reference: the prior's sigma that a status refers to; that of a --model is tighter.
void Widen(double factor, double prior_sigma, double reference, ParameterEstimate* estimate) {
  const double most = std::max(estimate->sigma, prior_sigma);
  estimate->sigma = std::min(factor * estimate->sigma, most);
  if (estimate->status == "identified" && estimate->sigma > 0.5 * reference) {
    estimate->status = "weak";
  }
}

}  // namespace

void WidenByScatter(const VgdOptions& options, EstimatorRun* run) {
  const VgdOptions ranges;  // of Table 2
  Estimates stated;
  for (const WindowEstimate& estimate : run->windows) stated.push_back(estimate.parameters);
  for (std::size_t window = 0; window < run->windows.size(); ++window) {
    const std::vector<std::size_t> windows = DisjointWindows(run->windows, window, options.gamma);
    if (windows.size() < 2) continue;
    std::vector<ParameterEstimate>& parameters = run->windows[window].parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      const int parameter = static_cast<int>(p);
      if (!IsVehicle(parameter)) continue;
      const double prior_sigma = options.PriorOf(parameter).sigma;
      const double reference = std::max(prior_sigma, ranges.PriorOf(parameter).sigma);
      Widen(Factor(stated, windows, p, prior_sigma), prior_sigma, reference, &parameters[p]);
    }
  }
}

}  // namespace trueline
