#include "problems/smoother/strengths.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "problems/common/error.h"
#include "problems/smoother/evidence_maximum.h"

namespace trueline {
namespace {

const double kLogSpread = std::log(3.0);  // prior of a strength's logarithm
constexpr double kReach = 0.4;            // of a logarithm, between points of the parabola
constexpr double kLatencyReach = 0.2;     // of the latency's prior sigma
constexpr int kMaxSteps = 12;
// Of the fits' costs. At a looser one the evidence depends on where a fit starts.
constexpr double kTolerance = 3e-7;
constexpr double kMostSpread = 0.5;  // of a logarithm's posterior, that Laplace's method describes
constexpr double kMargin = 1.0;      // s at a log's end that a latency may shift out of it

// One unknown of the evidence: the option it sets, and its unit in the search.
struct Unknown {
  std::string name, unit;
  void (*set)(VgdOptions*, double);  // in the order of the unknowns
  double start, prior_sigma, reach;
  bool logarithm;

  double Value(double z) const { return logarithm ? std::exp(z) : z; }
};

class Evidence {
 public:
  Evidence(const std::vector<FlightShare>& flights, const FlightProblemOptions& options,
           const WholeFlightOptions& whole)
      : flights_(flights), options_(options) {
    using Options = VgdOptions*;
    const VgdOptions& vgd = options.vgd;
    if (whole.learn_strengths) {
      AddStrength("tilt_drift", "rad", vgd.process.tilt,
                  [](Options o, double value) { o->process.tilt = value; });
      AddStrength("acceleration", "m/s^2/sqrt(Hz)", vgd.process.acceleration,
                  [](Options o, double value) { o->process.acceleration = value; });
      if (vgd.MeasuresThrust()) {
        AddStrength("thrust", "m/s^2/sqrt(Hz)",
                    vgd.process.acceleration * vgd.process.thrust_factor,
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
    }
    if (whole.attitude_latency > 0.0) {
      unknowns_.push_back({"attitude_latency", "s",
                           [](Options o, double value) { o->drive.attitude_latency = value; },
                           vgd.drive.attitude_latency, whole.attitude_latency,
                           kLatencyReach * whole.attitude_latency, false});
    }
    for (FlightShare& share : flights_)
      share.passes = PassesWithin(*share.flight, whole.learn_time);
  }

  const std::vector<Unknown>& unknowns() const { return unknowns_; }

  VgdOptions With(const Eigen::VectorXd& z) const {
    VgdOptions vgd = options_.vgd;
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      unknowns_[i].set(&vgd, unknowns_[i].Value(z[i]));
    }
    return vgd;
  }

  double operator()(const Eigen::VectorXd& z) {
    double log_prior = 0.0;
    for (std::size_t i = 0; i < unknowns_.size(); ++i) {
      log_prior -= 0.5 * std::pow((z[i] - unknowns_[i].start) / unknowns_[i].prior_sigma, 2);
    }
    FlightProblemOptions options = options_;
    options.vgd = With(z);
    options.vgd.tolerance = std::min(options.vgd.tolerance, kTolerance);
    std::vector<std::unique_ptr<FlightData>> made;
    const auto shares = WithLatency(flights_, options_.vgd, options.vgd, &made);
    FlightProblem problem(shares, options);
    if (last_) {
      problem.StartFrom(*last_);
    } else {
      problem.SetStart();
    }
    problem.Solve();
    last_ = problem.unknowns();
    return log_prior + problem.LogEvidence();
  }

  // The flights driven by an attitude of another latency; `made` owns them.
  static std::vector<FlightShare> WithLatency(const std::vector<FlightShare>& flights,
                                              const VgdOptions& before, const VgdOptions& vgd,
                                              std::vector<std::unique_ptr<FlightData>>* made) {
    if (before.drive.attitude_latency == vgd.drive.attitude_latency) return flights;
    std::vector<FlightShare> shares = flights;
    for (FlightShare& share : shares) {
      made->push_back(std::make_unique<FlightData>(share.flight->log, vgd.drive, vgd.passes,
                                                   vgd.drag_measurement));
      if (!HaveTheSameArcs(*share.flight, *made->back(), share.passes)) {
        throw InputError(fmt::format(
            "{}: a pass or arc lies too near the log's ends, or a gap of the attitude, for a "
            "latency of the attitude to be sought; set attitude_latency_sigma_s to 0, or cut the "
            "log there",
            share.flight->log.directory));
      }
      share.flight = made->back().get();
    }
    return shares;
  }

 private:
  // Where the option is not zero.
  void AddStrength(const char* name, const char* unit, double start,
                   void (*set)(VgdOptions*, double)) {
    if (start > 0.0) {
      unknowns_.push_back({name, unit, set, std::log(start), kLogSpread, kReach, true});
    }
  }
  // Of the first `passes`. If all are asked for, `b` may lack some at the end.
  static bool HaveTheSameArcs(const FlightData& a, const FlightData& b, int passes) {
    const int in_a = static_cast<int>(a.passes.size()), in_b = static_cast<int>(b.passes.size());
    if (passes <= in_a && in_b < passes) return false;
    const int count = std::min({passes, in_a, in_b});
    for (int k = 0; k < count; ++k) {
      if (a.passes[k].begin != b.passes[k].begin) return false;
      if (k + 1 < count && a.HasArc(k + 1) != b.HasArc(k + 1)) return false;
    }
    return true;
  }
  static int PassesWithin(const FlightData& flight, double seconds) {
    int count = 0;
    const TimeNs end = flight.track.end() - FromSeconds(kMargin);
    for (const Pass& pass : flight.passes) {
      count += pass.end < end && SecondsBetween(flight.passes.front().begin, pass.end) <= seconds;
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
                         const FlightProblemOptions& options, const WholeFlightOptions& whole) {
  Evidence evidence(flights, options, whole);
  const std::vector<Unknown>& unknowns = evidence.unknowns();
  Strengths result{options.vgd, {}, {}, {}};
  if (unknowns.empty()) return result;
  const Eigen::Index n = static_cast<Eigen::Index>(unknowns.size());
  Eigen::VectorXd start(n), reach(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    start[i] = unknowns[i].start;
    reach[i] = unknowns[i].reach;
  }
  const EvidenceMaximum maximum =
      MaximiseEvidence([&](const Eigen::VectorXd& z) { return evidence(z); }, start, reach,
                       std::log(4.0), kMaxSteps);
  result.converged = maximum.converged;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double z = maximum.at[i], half = 1.96 * std::sqrt(maximum.cov(i, i));
    result.learned.push_back({unknowns[i].name, unknowns[i].Value(z), unknowns[i].Value(z - half),
                              unknowns[i].Value(z + half), unknowns[i].unit});
  }
  // Intervals are those of an average over the strengths' posterior: variances grow with the mean
  // square of a strength, which exceeds the square of its mode.
  Eigen::VectorXd root_mean_square = maximum.at;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!unknowns[i].logarithm) continue;
    root_mean_square[i] += std::min(maximum.cov(i, i), kMostSpread * kMostSpread);
  }
  result.vgd = evidence.With(root_mean_square);
  // The forces' own scatter makes room for gusts of the right strength while these are learned.
  // What is left in the forces is no white noise, so the fit keeps the larger sigma.
  result.vgd.drag_measurement.scale = options.vgd.drag_measurement.scale;
  result.shares = Evidence::WithLatency(flights, options.vgd, result.vgd, &result.flights);
  return result;
}

}  // namespace trueline
