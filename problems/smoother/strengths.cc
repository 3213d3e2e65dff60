#include "problems/smoother/strengths.h"

#include <cmath>
#include <optional>

#include "problems/smoother/evidence_maximum.h"

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

}  // namespace

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

}  // namespace trueline
