#include "problems/smoother/whole_flight.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/common/error.h"
#include "problems/result/identifiability.h"
#include "problems/smoother/strengths.h"

namespace trueline {
namespace {

// Indices of the stated unknowns: their prior has a width, and the accelerometer is used if they
// need it.
std::vector<int> Asked(const FlightProblem& problem) {
  std::vector<int> asked;
  for (int i = 0; i < kStatedSize; ++i) {
    const bool possible = i < kForceBiasInTheta || problem.HasForces();
    if (possible && problem.scaling().sigma[i] > 0.0) asked.push_back(i);
  }
  return asked;
}

// For K_x and K_y: whether the flight shows them. An estimate whose interval, once errors of the
// velocity and gusts widen it, is as wide as the prior's is attenuated and not used.
std::array<bool, 2> ShownDrag(const FlightProblemOptions& options,
                              const FlightProblem::Means& means, const Eigen::VectorXd& prior) {
  Eigen::MatrixXd cov = means.cov;
  WidenDrag(means.drag_errors, options.vgd, means.force_sigma, prior, &cov);
  std::array<bool, 2> shown = means.drag_errors.ShowsDrag();
  for (const int i : {0, 1}) {
    const int k = kDragInTheta + i;
    if (StatusByRatio(std::sqrt(cov(k, k))) == "unobservable") shown[i] = false;
  }
  return shown;
}

std::vector<std::string> DragNotes(const DragErrors& drag_errors,
                                   const std::array<bool, 2>& shown) {
  std::vector<std::string> notes;
  for (const int i : {0, 1}) {
    if (shown[i]) continue;
    notes.push_back(fmt::format(
        "{} is not read from the accelerometer: the vehicle's speed along {}_B seems to vary by "
        "{:.3f} m/s, of which its error and gusts explain {:.3f} m/s; fly with changes of speed "
        "along that axis",
        kTheta[kDragInTheta + i].name, "xy"[i], drag_errors.Spread()[i],
        drag_errors.Uncommanded()[i]));
  }
  return notes;
}

// Restores the prior's variance of a parameter that was held, and widens all parameters correlated
// with it.
void WidenHeld(const std::array<bool, 2>& drag_shows, Eigen::MatrixXd* cov) {
  constexpr int kX = kDragInTheta, kY = kX + 1;
  if (!drag_shows[0] && !drag_shows[1]) (*cov)(kX, kY) = (*cov)(kY, kX) = 0.0;
  for (const int i : {0, 1}) {
    if (!drag_shows[i]) Widen(kX + i, 1.0, cov);
  }
}

void StoreParameters(const FlightProblemOptions& options, const FlightProblem& problem,
                     FlightProblem::Means means, WholeFlight* result) {
  const ParameterScaling& prior = problem.scaling();
  const std::vector<int> asked = Asked(problem);
  const Eigen::MatrixXd model_cov = means.cov;
  WidenDrag(means.drag_errors, options.vgd, means.force_sigma, prior.sigma, &means.cov);
  const Eigen::VectorXd deviation = ReturnDrag(options.vgd, model_cov, means.cov, means.value);
  WidenHeld(options.drag_shows, &means.cov);
  std::vector<std::string> names, units;
  for (const int i : asked) {
    names.emplace_back(kTheta[i].name);
    units.emplace_back(kTheta[i].unit);
  }
  const Eigen::VectorXd sigma = prior.sigma(asked);
  const Eigen::MatrixXd cov = means.cov(asked, asked);
  const Identifiability shown = AnalyseIdentifiability(names, units, sigma, cov);
  result->unobservable = shown.combinations;
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const int i = asked[k];
    const double fitted = prior.mean[i] + prior.sigma[i] * means.value[i];
    const bool at_bound = i < kMotionSize && AtBound(options.vgd.priors[i], fitted);
    result->parameters.push_back(
        {names[k], prior.mean[i] + prior.sigma[i] * deviation[i], sigma[k] * std::sqrt(cov(k, k)),
         units[k], at_bound ? "at_bound" : shown.status[k], sigma[k] * std::sqrt(model_cov(i, i))});
  }
}

}  // namespace

void Serialize(YamlArchive* a, WholeFlightOptions* o) {
  a->Value("learn_strengths", &o->learn_strengths);
  a->Value("withhold_drag", &o->withhold_drag);
  a->Positive("learn_time_s", &o->learn_time);
}

WholeFlight RunWholeFlight(const std::vector<FlightShare>& flights, const VgdOptions& vgd,
                           const SmootherOptions& walks, const WholeFlightOptions& options) {
  if (!vgd.process.Any()) {
    throw InputError(
        "the smoother needs process noise: set a strength under 'process' in the configuration");
  }
  WholeFlight result;
  FlightProblemOptions problem_options{vgd, walks};
  Strengths strengths{vgd, {}};
  if (options.learn_strengths) {
    strengths = LearnStrengths(flights, problem_options, options.learn_time);
  }
  result.strengths = strengths.learned;
  if (!strengths.converged) {
    result.notes.emplace_back(
        "the search for the strengths did not converge: the fit uses the last ones tried, and the "
        "intervals may be wrong; start nearer to them ('process'), or set learn_strengths: false");
  }
  problem_options.vgd = strengths.vgd;

  auto problem = std::make_unique<FlightProblem>(flights, problem_options);
  problem->SetStart();
  ceres::Solver::Summary summary = problem->Solve();
  FlightProblem::Means means = problem->MeanUnknowns();
  if (options.withhold_drag && problem->HasForces()) {
    problem_options.drag_shows = ShownDrag(problem_options, means, problem->scaling().sigma);
  }
  if (!problem_options.drag_shows[0] || !problem_options.drag_shows[1]) {
    const SegmentChain::Unknowns start = problem->unknowns();
    problem.reset();  // an hour's problem takes 300 MB
    problem = std::make_unique<FlightProblem>(flights, problem_options);
    problem->StartFrom(start);
    summary = problem->Solve();
    const auto notes = DragNotes(means.drag_errors, problem_options.drag_shows);
    result.notes.insert(result.notes.end(), notes.begin(), notes.end());
    means = problem->MeanUnknowns();
  }
  result.iterations = static_cast<int>(summary.iterations.size()) - 1;
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.solve_time = summary.total_time_in_seconds;
  result.flights = static_cast<int>(flights.size());
  for (const FlightShare& share : flights) {
    const std::vector<Pass>& passes = share.flight->passes;
    result.passes += static_cast<int>(passes.size());
    result.seconds += SecondsBetween(passes.front().begin, passes.back().end);
  }
  StoreParameters(problem_options, *problem, std::move(means), &result);
  result.trajectory = problem->Trajectory();
  return result;
}

}  // namespace trueline
