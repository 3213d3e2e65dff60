// The least-squares problem of whole flights of one vehicle, in one sparse chain.
//
// A section reaches from one pass to the next. It holds theta and, as windows do, segments with a
// state and an AHRS drift each. From section to section b_a and the AHRS error do a random walk;
// the airframe's parameters are tied. Flights follow each other in the chain: only the airframe's
// tie continues between flights. All couplings are between neighbours, so the cost is linear
// in the flight's length.
#pragma once

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include "cost_functions/prior_residuals.h"
#include "problems/smoother/whole_flight.h"
#include "problems/vgd/correlated_fixes.h"
#include "problems/vgd/drag_errors.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/rough_path.h"
#include "problems/vgd/segment_chain.h"
#include "problems/vgd/solver_options.h"

namespace trueline {

struct FlightProblemOptions {
  VgdOptions vgd;
  SmootherOptions walks;
  std::array<bool, 2> drag_shows = {true, true};  // K_x, K_y: false holds it at its prior's mean
};

class FlightProblem {
 public:
  FlightProblem(const std::vector<FlightShare>& flights, const FlightProblemOptions& options)
      : flights_(flights), options_(options), chain_(options.vgd) {
    BuildSections();
    chain_.SetBounds();
    AddOffsets();
    AddCorrelatedFixes();
    for (std::size_t k = 0; k < sections_.size(); ++k) {
      AddParameterPriors(k);
      if (k > 0) AddParameterStep(k);
      AddMeasurements(k);
      AddProcess(k);
    }
  }

  // Initialises from the fixes and the priors' means, or from another problem with the same knots.
  void SetStart() {
    for (std::size_t k = 0; k < sections_.size();) {
      const std::size_t end = EndOfRun(k);
      const FlightData& flight = *flights_[sections_[k].flight].flight;
      std::vector<Pass> trusted;
      for (std::size_t i = k; i < end; ++i) {
        if (offsets_.count(i) == 0) trusted.push_back(flight.passes[sections_[i].pass]);
      }
      if (trusted.empty()) trusted.push_back(flight.passes[sections_[k].pass]);
      const RoughPath path(flight.log.fixes, trusted);
      for (std::size_t s = sections_[k].first_segment; s < sections_[end - 1].end_segment; ++s) {
        const LineFit guess = path.At(chain_.segment(s).start());
        chain_.SetState(s, guess.p, guess.v);
      }
      k = end;
    }
  }
  void StartFrom(const SegmentChain::Unknowns& x) { chain_.StartFrom(x); }
  const SegmentChain::Unknowns& unknowns() const { return chain_.unknowns(); }

  ceres::Solver::Summary Solve() {
    TrustRegionOptions options;
    options.max_iterations = options_.vgd.max_iterations;
    options.tolerance = options_.vgd.tolerance;
    // Levenberg-Marquardt damping is proportional to the Hessian's diagonal, which the stiff ties
    // dominate; it would hold the airframe's parameters. Start with nearly undamped Gauss-Newton
    // steps.
    options.radius = 1e12;
    return chain_.Solve(options);
  }

  // As WindowProblem's: logarithm of the marginal likelihood by Laplace's approximation.
  double LogEvidence() { return chain_.LogEvidence(); }

  // Means over all flights of theta in prior sigmas, with drift where the AHRS error drifts.
  struct Means {
    ThetaVector value = ThetaVector::Zero();
    Eigen::MatrixXd cov;
    DragErrors drag_errors;
    double force_sigma = 0.0;  // m/s^2, the largest of the flights'
  };
  Means MeanUnknowns() {
    using Normal = SegmentChain::Normal;
    Means means;
    const auto seconds = [this](std::size_t s) {
      return SecondsBetween(chain_.segment(s).start(), chain_.segment(s).end());
    };
    double total = 0.0;
    for (std::size_t s = 0; s < chain_.size(); ++s) total += seconds(s);
    std::vector<double> shares;
    for (std::size_t k = 0; k < sections_.size(); ++k) {
      for (std::size_t s = sections_[k].first_segment; s < sections_[k].end_segment; ++s) {
        const double share = seconds(s) / total;
        shares.push_back(share);
        means.value += share * chain_.theta(k);
        means.value.segment<kDriftSize>(kAhrsInTheta) += share * chain_.node(s).head<kDriftSize>();
      }
    }
    means.cov = chain_.Covariance(kThetaSize, [&](std::size_t s, SegmentChain::Columns* G) {
      G->block<kThetaSize, kThetaSize>(Normal::kSharedAt, 0).diagonal().array() += shares[s];
      G->block<kDriftSize, kDriftSize>(Normal::kNodeAt, kAhrsInTheta).diagonal().array() +=
          shares[s];
    });
    for (const FlightShare& share : flights_) {
      means.force_sigma = std::max(means.force_sigma, ForceSigma(*share.flight));
    }
    const std::size_t step = 1 + chain_.size() / kSampled;
    chain_.VisitCovariances([&](std::size_t s, const Eigen::MatrixXd& F) {
      if (s % step != 0 || chain_.segment(s).force_count() == 0) return;
      chain_.AddDragErrors(s, F, static_cast<int>(step), &means.drag_errors);
    });
    return means;
  }

  std::vector<TrajectoryPoint> Trajectory() const {
    std::vector<TrajectoryPoint> points;
    for (const auto& segment : chain_.segments()) {
      for (const TimeNs t : segment->times()) {
        const auto& x = segment->StateAt(t)->value;
        points.push_back({t, x.head<3>(), x.tail<3>()});
      }
    }
    return points;
  }
  const ParameterScaling& scaling() const { return chain_.scaling(); }
  bool HasForces() const { return chain_.HasForces(); }

 private:
  // The airframe's parameters may change by this share of their prior sigma from section to
  // section. This nearly rigid tie keeps the chain banded; the share is far below any flight's
  // resolution.
  static constexpr double kTie = 1e-4;
  static constexpr double kHeld = 1e4;  // in each section, times the weight of the prior
  // Segments at which the velocity's covariance is computed.
  static constexpr std::size_t kSampled = 200;

  // A pass and the arc after it; its parameters are theta(index).
  struct Section {
    int flight;
    int pass;  // index in its flight
    TimeNs begin, end;
    std::size_t first_segment, end_segment;
    bool continues;  // no break since the section before
  };

  bool HasCorrelatedFixes(const FlightData& flight) const {
    return flight.continuous && flight.continuous->noise.IsCorrelated();
  }
  // Of pass `k`, with the arc after it if `arc`. Fixes that are correlated count on the arc, too.
  WindowData DataOf(const FlightData& flight, int k, bool arc) const {
    WindowData data = CutWindow(flight, options_.vgd, k, k + 1, arc);
    if (HasCorrelatedFixes(flight) && data.end > flight.passes[k].end) {
      const std::size_t first = flight.passes[k].first;
      data.fixes =
          std::span(flight.log.fixes).subspan(first, flight.passes[k + 1].first - first + 1);
    }
    return data;
  }
  std::vector<TimeNs> KnotsOf(const FlightData& flight, const WindowData& data) const {
    const double interval = options_.vgd.knot_interval;
    if (!HasCorrelatedFixes(flight)) return EvenKnots(data.begin, data.end, interval);
    return KnotsAtFixes(data.fixes, data.begin, data.end, data.noise, interval);
  }
  // One after the last section that continues from `section` without a break.
  std::size_t EndOfRun(std::size_t section) const {
    std::size_t end = section + 1;
    while (end < sections_.size() && sections_[end].continues) ++end;
    return end;
  }
  // Each run without a break counts from its first fix.
  void AddCorrelatedFixes() {
    for (const Section& section : sections_) {
      const FlightData& flight = *flights_[section.flight].flight;
      if (!HasCorrelatedFixes(flight)) continue;
      correlated_.try_emplace(section.flight, &chain_, flight.continuous->noise, options_.vgd);
    }
    for (std::size_t k = 0; k < sections_.size(); k = EndOfRun(k)) {
      const Section &first = sections_[k], &last = sections_[EndOfRun(k) - 1];
      const auto fixes = correlated_.find(first.flight);
      if (fixes == correlated_.end()) continue;
      const FlightData& flight = *flights_[first.flight].flight;
      const std::size_t from = flight.passes[first.pass].first, to = flight.passes[last.pass].last;
      fixes->second.Add(std::span(flight.log.fixes).subspan(from, to - from + 1), 0,
                        first.first_segment, last.end_segment);
    }
  }
  void BuildSections() {
    for (std::size_t f = 0; f < flights_.size(); ++f) {
      const FlightData& flight = *flights_[f].flight;
      const int count = std::min(static_cast<int>(flight.passes.size()), flights_[f].passes);
      for (int k = 0; k < count; ++k) {
        const WindowData data = DataOf(flight, k, k + 1 < count);
        const bool continues = k > 0 && flight.HasArc(k);
        const std::size_t first = chain_.size();
        chain_.AddTheta();
        const auto knots = KnotsOf(flight, data);
        for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
          auto segment = MakeSegment(flight.track, data, knots[i], knots[i + 1], scaling(),
                                     options_.vgd.max_block);
          segment->FollowDerivatives();
          chain_.AddSegment(std::move(segment), i > 0 || continues);
        }
        sections_.push_back(
            {static_cast<int>(f), k, data.begin, data.end, first, chain_.size(), continues});
      }
    }
  }
  void AddOffsets() {
    Eigen::VectorXd weight(kOffsetSize);
    weight << Eigen::Vector3d::Constant(1.0 / FalsePassOptions::kOffset),
        Eigen::Vector3d::Constant(1.0 / FalsePassOptions::kOffsetRate);
    for (std::size_t k = 0; k < sections_.size(); ++k) {
      if (flights_[sections_[k].flight].false_passes.count(sections_[k].pass) == 0) continue;
      offsets_[k] = chain_.AddBorder(sections_[k].first_segment, weight, true);
    }
  }
  // The first flight gets the full prior. A later one gets none on the airframe, whose parameters
  // are tied to the flight before. Drag that is not fitted is held in every section, so that a long
  // flight's many sections do not outweigh the prior.
  void AddParameterPriors(std::size_t section) {
    const std::size_t s = sections_[section].first_segment;
    if (section == 0 || sections_[section].flight != sections_[section - 1].flight) {
      ThetaVector weight = ThetaVector::Ones();
      for (int i = 0; i < kThetaSize; ++i) {
        if (section > 0 && IsAirframe(i)) weight[i] = 0.0;
      }
      chain_.AddThetaPrior(s, weight);
    }
    ThetaVector held = ThetaVector::Zero();
    for (const int i : {0, 1}) {
      if (!options_.drag_shows[i]) held[kDragInTheta + i] = kHeld;
    }
    if (!held.isZero()) chain_.AddThetaPrior(s, held);
  }
  void AddParameterStep(std::size_t section) {
    const Section &last = sections_[section - 1], &next = sections_[section];
    ThetaVector sigma = ThetaVector::Zero();
    if (last.flight == next.flight) {
      const double root = std::sqrt(SecondsBetween(last.begin, next.begin));
      for (int i = 0; i < kThetaSize; ++i) sigma[i] = options_.walks.WalkOf(kTheta[i].group) * root;
      sigma = sigma.cwiseQuotient(scaling().sigma).cwiseMax(kTie);
    } else {
      sigma.setConstant(std::numeric_limits<double>::infinity());
    }
    for (int i = 0; i < kThetaSize; ++i) {
      if (IsAirframe(i)) sigma[i] = kTie;
    }
    using Step =
        ceres::AutoDiffCostFunction<ParameterStepError, kThetaSize, kThetaSize, kThetaSize>;
    chain_.AddThetaStep(section - 1, new Step(new ParameterStepError{sigma.cwiseInverse()}));
  }
  void AddMeasurements(std::size_t section) {
    const Section& own = sections_[section];
    const FlightData& flight = *flights_[own.flight].flight;
    const bool with_arc = own.end > flight.passes[own.pass].end;
    const WindowData data = CutWindow(flight, options_.vgd, own.pass, own.pass + 1, with_arc);
    if (!HasCorrelatedFixes(flight)) {
      for (const Fix& fix : data.fixes) AddFix(fix, section);
    }
    const double sigma = ForceSigma(flight);
    for (const ForceSample& force : data.forces) {
      chain_.AddForce(chain_.SegmentAt(force.t, own.first_segment, own.end_segment), force, sigma);
      chain_.AddLogWeights(-2.0 * std::log(sigma));  // x and y
    }
  }
  void AddFix(const Fix& fix, std::size_t section) {
    const Section& own = sections_[section];
    const std::size_t s = chain_.SegmentAt(fix.t, own.first_segment, own.end_segment);
    const StateNode* state = chain_.segment(s).StateAt(fix.t);
    const GustSlope<6> gusts = chain_.StateGusts(s, fix.t);
    const FixError error{fix.p_E, fix.sigma};
    ceres::LossFunction* loss = MakeLoss(options_.vgd.loss, options_.vgd.loss_scale);
    if (const auto offset = offsets_.find(section); offset != offsets_.end()) {
      const double elapsed = SecondsBetween(own.begin, fix.t);
      chain_.AddReading(s, new OffsetFixResidual(state, {error, elapsed}, gusts), loss,
                        {offset->second});
    } else {
      chain_.AddReading(s, new FixResidual(state, error, gusts), loss);
    }
  }
  void AddProcess(std::size_t section) {
    const Section& own = sections_[section];
    const double gravity = flights_[own.flight].flight->track.gravity();
    for (std::size_t s = own.first_segment; s < own.end_segment; ++s) {
      if (s == own.first_segment && !own.continues) {
        chain_.AddStart(s);
      } else {
        chain_.AddStep(s - 1, gravity);
      }
    }
  }
  double ForceSigma(const FlightData& flight) const {
    return options_.vgd.drag_measurement.scale * flight.forces.sigma;
  }

  std::vector<FlightShare> flights_;
  FlightProblemOptions options_;
  SegmentChain chain_;
  std::vector<Section> sections_;
  std::map<std::size_t, double*> offsets_;     // of false passes, by section
  std::map<int, CorrelatedFixes> correlated_;  // by flight
};

}  // namespace trueline
