// Errors of the IMU-driven model on the half of a flight that it was not fitted to.
#include <algorithm>
#include <cmath>

#include "problems/common/parallel.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/imu_flight.h"

namespace trueline {
namespace {

constexpr int kReplayEvery = 2;  // segments, between starts of held-out replays

// The window's prior has the other half's estimates as means. Its sigmas add a share of the usual
// spread between vehicles: gusts bias drag and accelerometer biases by more than their stated
// sigmas.
VgdOptions WindowOptions(const VgdOptions& options, const PartFit& fit) {
  constexpr double kOfPrior = 0.3;
  VgdOptions vgd = options;
  vgd.adapt_drift = false;  // the same drift for all models
  for (std::size_t i = 0; i < vgd.priors.size(); ++i) {
    ParameterPrior& prior = vgd.priors[i];
    prior.mean = std::clamp(fit.value[static_cast<int>(i)], prior.lower, prior.upper);
    prior.sigma = std::hypot(kOfPrior * prior.sigma, fit.sigma[static_cast<int>(i)]);
  }
  vgd.drive.force_effects = ForceEffectsOf(fit.effects);
  return vgd;
}

}  // namespace

PartFit ImuDrivenFlight::FitOf(const std::vector<Found>& found,
                               const std::vector<bool>& used) const {
  Eigen::VectorXd weight = fit_.weight;
  for (int row = 0; row < weight.size(); ++row) {
    if (!used[flight_->ClusterOfRow(row)]) weight[row] = 0.0;
  }
  const ChainSystem system(LinearFlight{*flight_, fit_.rows, fit_.x, weight, fit_.columns},
                           fit_.noise);
  const ParameterScaling scaling(options_);
  const Eigen::MatrixXd cov = system.reduced().Covariance();
  const Eigen::VectorXd step = system.reduced().Solution();
  const ThetaVector theta = fit_.x.theta + step.head<kThetaSize>();
  PartFit part{scaling.mean + scaling.sigma.cwiseProduct(theta),
               scaling.sigma.cwiseProduct(cov.diagonal().head<kThetaSize>().cwiseSqrt()),
               log_->options.effects};
  int at = kThetaSize + OrdinaryCount();
  for (const Found& f : found) {
    part.effects.push_back(f.candidate.At(f.value + step.segment(at, f.value.size())));
    at += static_cast<int>(f.value.size());
  }
  return part;
}

// Final points of VGD's arcs of one half, predicted with the other half's estimates. The window
// estimates its own state only, so that errors compare models and not the noise of refitted
// parameters. All models are compared under one process noise, the one learned without causes: a
// larger one would let windows forget their past and hide model errors on an arc.
void ImuDrivenFlight::AddArcs(const FlightLog& corrected, const PartFit& fit, int half,
                              std::map<int, double>* errors) const {
  VgdOptions vgd = WindowOptions(log_->options.vgd, fit);
  vgd.process = bare_process_;
  const FlightData flight(corrected, vgd.drive, vgd.passes, vgd.drag_measurement);
  for (int tau = 1; tau <= static_cast<int>(flight.passes.size()); ++tau) {
    const Pass& pass = flight.passes[tau - 1];
    const int cluster = plan_.ClusterAt((pass.begin + pass.end) / 2);
    if (!flight.HasArc(tau) || HalfOf(cluster) != half) continue;
    const WindowEstimate window = SolveWindow(flight, vgd, tau, PriorMeans(vgd));
    if (window.arc && window.arc->truth) (*errors)[cluster] = window.arc->FinalPointError();
  }
}

// Only the streams count whose comparison with mocap does not use what the fit used.
void ImuDrivenFlight::AddAgreement(const PartFit& fit, int half, HeldOutErrors* errors) const {
  const FlightLog corrected = CorrectLog(log_->data, fit.effects, mocap_->path());
  const bool fitted_to_mocap = IsFittedToMocap(log_->data);
  const auto counts = [&](double t) {
    return HalfOf(plan_.ClusterAt(corrected.imu.front().t + FromSeconds(t))) == half;
  };
  for (const StreamComparison& c : IndependentComparisons(*mocap_, fitted_to_mocap)) {
    errors->streams[c.stream] = {c.unit, DistancesFromMocap(c.rows(corrected), counts)};
  }
}

HeldOutErrors ImuDrivenFlight::ErrorsOfHalf(const FlightLog& log, const PartFit& fit,
                                            int half) const {
  HeldOutErrors errors;
  const FlightLog corrected = CorrectLog(log, fit.effects, path_);
  if (!corrected.fixes.empty()) AddArcs(corrected, fit, half, &errors.arcs);
  if (!mocap_) return errors;
  AddAgreement(fit, half, &errors);
  std::vector<int> segments;
  for (int s = 0; s < static_cast<int>(plan_.segments.size()); s += kReplayEvery) {
    if (HalfOf(plan_.segments[s].cluster) == half) segments.push_back(s);
  }
  for (const ReplayError& r : ReplayPart(log, corrected, fit, segments)) {
    errors.replays[r.segment] = r.error_E.norm();
  }
  return errors;
}

HeldOutErrors ImuDrivenFlight::ErrorsHeldOut(const std::vector<Found>& found,
                                             bool with_false_data) const {
  std::array<HeldOutErrors, 2> errors;
  ParallelFor(2, 0, [&](int half) {
    std::vector<bool> used(plan_.clusters);
    for (int c = 0; c < plan_.clusters; ++c) used[c] = HalfOf(c) != half;
    const FlightLog& log = with_false_data ? log_->recorded : log_->kept;
    errors[half] = ErrorsOfHalf(log, FitOf(found, used), half);
  });
  errors[0].arcs.merge(errors[1].arcs);
  errors[0].replays.merge(errors[1].replays);
  for (auto& [stream, of] : errors[0].streams) {
    of.by_second.merge(errors[1].streams[stream].by_second);
  }
  return errors[0];
}

}  // namespace trueline
