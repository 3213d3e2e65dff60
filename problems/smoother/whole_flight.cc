#include "problems/smoother/whole_flight.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "problems/common/error.h"
#include "problems/result/identifiability.h"
#include "problems/smoother/evidence_maximum.h"
#include "problems/smoother/flight_problem.h"

namespace trueline {
namespace {

const double kLogSpread = std::log(3.0);  // prior of a strength's logarithm
constexpr double kReach = 0.4;            // of a logarithm, between points of the parabola
constexpr int kMaxSteps = 12;
// Of the fits' costs. At a looser one the evidence depends on where a fit starts.
constexpr double kTolerance = 3e-7;
constexpr double kMostSpread = 0.5;  // of a logarithm's posterior, that Laplace's method describes

// One unknown of the evidence, by its logarithm: the option it sets.
struct Unknown {
  std::string name, unit;
  void (*set)(VgdOptions*, double);  // in the order of the unknowns
  double start;                      // logarithm
};

class Evidence {
 public:
  Evidence(const std::vector<FlightShare>& flights, const FlightProblemOptions& options,
           double seconds)
      : flights_(flights), options_(options) {
    using Options = VgdOptions*;
    const VgdOptions& vgd = options.vgd;
    AddStrength("tilt_drift", "rad", vgd.process.tilt,
                [](Options o, double value) { o->process.tilt = value; });
    AddStrength("acceleration", "m/s^2/sqrt(Hz)", vgd.process.acceleration,
                [](Options o, double value) { o->process.acceleration = value; });
    if (vgd.MeasuresThrust()) {
      AddStrength("thrust", "m/s^2/sqrt(Hz)", vgd.process.acceleration * vgd.process.thrust_factor,
                  [](Options o, double value) {
                    o->process.thrust_factor = value / o->process.acceleration;
                  });
    }
    if (vgd.UsesGusts()) {
      AddStrength("gust", "m/s^2", vgd.process.gust,
                  [](Options o, double value) { o->process.gust = value; });
      AddStrength("force_scale", "1", vgd.drag_measurement.scale,
                  [](Options o, double value) { o->drag_measurement.scale = value; });
    }
    for (FlightShare& share : flights_) share.passes = PassesWithin(*share.flight, seconds);
  }

  const std::vector<Unknown>& unknowns() const { return unknowns_; }

  VgdOptions With(const Eigen::VectorXd& z) const {
    VgdOptions vgd = options_.vgd;
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      unknowns_[i].set(&vgd, std::exp(z[i]));
    }
    return vgd;
  }

  double operator()(const Eigen::VectorXd& z) {
    double log_prior = 0.0;
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      log_prior -= 0.5 * std::pow((z[i] - unknowns_[i].start) / kLogSpread, 2);
    }
    FlightProblemOptions options = options_;
    options.vgd = With(z);
    options.vgd.tolerance = std::min(options.vgd.tolerance, kTolerance);
    FlightProblem problem(flights_, options);
    if (last_) {
      problem.StartFrom(*last_);
    } else {
      problem.SetStart();
    }
    problem.Solve();
    last_ = problem.unknowns();
    return log_prior + problem.LogEvidence();
  }

 private:
  // Where the option is not zero.
  void AddStrength(const char* name, const char* unit, double start,
                   void (*set)(VgdOptions*, double)) {
    if (start > 0.0) unknowns_.push_back({name, unit, set, std::log(start)});
  }
  static int PassesWithin(const FlightData& flight, double seconds) {
    int count = 0;
    for (const Pass& pass : flight.passes) {
      count += SecondsBetween(flight.passes.front().begin, pass.end) <= seconds;
    }
    return std::max(count, std::min(2, static_cast<int>(flight.passes.size())));
  }

  std::vector<FlightShare> flights_;
  FlightProblemOptions options_;
  std::vector<Unknown> unknowns_;
  std::optional<SegmentChain::Unknowns> last_;
};

struct Strengths {
  VgdOptions vgd;  // with the strengths' root mean squares
  std::vector<LearnedStrength> learned;
  // False if the search ended before it settled: the values are the last ones tried.
  bool converged = true;
};

// Maximises the marginal likelihood (Laplace's approximation over all states and parameters) over
// the logarithms of process.tilt, process.acceleration across and along the thrust and, where the
// accelerometer measures drag, process.gust and the forces' scale. Intervals
// come from the curvature. The priors of the logarithms have a sigma of a factor of three. Uses the
// first `seconds` of each flight.
Strengths LearnStrengths(const std::vector<FlightShare>& flights,
                         const FlightProblemOptions& options, double seconds) {
  Evidence evidence(flights, options, seconds);
  const std::vector<Unknown>& unknowns = evidence.unknowns();
  Strengths result{options.vgd, {}};
  if (unknowns.empty()) return result;
  const Eigen::Index n = static_cast<Eigen::Index>(unknowns.size());
  Eigen::VectorXd start(n);
  for (Eigen::Index i = 0; i < n; ++i) start[i] = unknowns[i].start;
  const EvidenceMaximum maximum =
      MaximiseEvidence([&](const Eigen::VectorXd& z) { return evidence(z); }, start,
                       Eigen::VectorXd::Constant(n, kReach), std::log(4.0), kMaxSteps);
  result.converged = maximum.converged;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double z = maximum.at[i], half = 1.96 * std::sqrt(maximum.cov(i, i));
    result.learned.push_back(
        {unknowns[i].name, std::exp(z), std::exp(z - half), std::exp(z + half), unknowns[i].unit});
  }
  // Intervals are those of an average over the strengths' posterior: variances grow with the mean
  // square of a strength, which exceeds the square of its mode.
  const Eigen::VectorXd root_mean_square =
      maximum.at + maximum.cov.diagonal().cwiseMin(kMostSpread * kMostSpread);
  result.vgd = evidence.With(root_mean_square);
  // The forces' own scatter makes room for gusts of the right strength while these are learned.
  // What is left in the forces is no white noise, so the fit keeps the larger sigma.
  result.vgd.drag_measurement.scale = options.vgd.drag_measurement.scale;
  return result;
}

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
