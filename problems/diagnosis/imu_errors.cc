// Errors of the IMU-driven model: open-loop replays, the half of a flight that it was not fitted
// to, whitened residuals; and what a diagnosis reports of the fit.
#include <algorithm>
#include <cmath>

#include "cost_functions/models/cubic_path.h"
#include "problems/common/parallel.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/misfit.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"
#include "problems/result/yaml_text.h"
#include "problems/trajectory/mocap_path.h"
#include "problems/vgd/motion_chain.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

// Horizons from a quarter of a second to the median arc between passes.
std::vector<double> Horizons(const FlightLog& log, const PassOptions& options) {
  std::vector<double> horizons(std::begin(kReplayHorizons), std::end(kReplayHorizons));
  const std::vector<Pass> passes = FindPasses(log.fixes, options);
  std::vector<double> arcs;
  for (std::size_t i = 1; i < passes.size(); ++i) {
    const double arc = SecondsBetween(passes[i - 1].end, passes[i].begin);
    if (arc < options.max_arc) arcs.push_back(arc);
  }
  if (arcs.empty()) return horizons;
  const double arc = UpperMedian(arcs);
  std::erase_if(horizons, [arc](double h) { return std::abs(h - arc) < 0.1 * arc; });
  horizons.push_back(arc);
  std::sort(horizons.begin(), horizons.end());
  return horizons;
}

// Fitted position at t: the cubic through the knots' positions and velocities.
Vector3d FittedAt(const FlightPlan& plan, const std::vector<NodeVector>& nodes, TimeNs t) {
  const int s = plan.SegmentOf(t);
  const auto& span = plan.segments[s];
  const Vector3d p0 = nodes[s].segment<3>(kStateAt), v0 = nodes[s].segment<3>(kStateAt + 3);
  if (!span.linked) return p0 + v0 * SecondsBetween(span.begin, t);
  const Vector3d p1 = nodes[s + 1].segment<3>(kStateAt), v1 = nodes[s + 1].segment<3>(kStateAt + 3);
  const double h = SecondsBetween(span.begin, span.end);
  return CubicPath(p0, v0, p1, v1, h, SecondsBetween(span.begin, t) / h);
}

// True if the segments from `segment` to the one that holds `end` have no break between them.
bool OneStretch(const FlightPlan& plan, int segment, TimeNs end) {
  std::size_t s = static_cast<std::size_t>(segment);
  while (plan.segments[s].end < end && plan.segments[s].linked) ++s;
  return plan.segments[s].end >= end;
}

// What replays share: the fit that they start from, and the model.
struct Replays {
  const FlightLog& log;  // as recorded
  const FlightPlan& plan;
  const std::vector<NodeVector>& nodes;  // fitted
  ThetaVector parameters;
  ForceEffects forces;  // bound to the log
  const DriveTrack& track;

  std::optional<Vector3d> Measured(TimeNs t) const {
    if (!log.mocap.empty()) return PositionAt(log.mocap, t);
    return FittedAt(plan, nodes, t);
  }
};

ForceEffects BoundForces(const std::vector<Effect>& effects, const FlightLog& log) {
  ForceEffects forces = ForceEffectsOf(effects);
  BindTerms(log, &forces);
  return forces;
}

// Replays from one knot over all `horizons` (ascending) that fit into the flight.
void ReplayFrom(const Replays& replays, int segment, const std::vector<double>& horizons,
                std::vector<ReplayError>* out) {
  const TimeNs start = replays.plan.segments[segment].begin;
  const auto here = replays.Measured(start);
  std::vector<TimeNs> times;
  std::vector<Vector3d> measured;
  for (const double h : horizons) {
    const TimeNs end = start + FromSeconds(h);
    const bool held = OneStretch(replays.plan, segment, end) && replays.track.Covers(start, end);
    const auto there = held && here ? replays.Measured(end) : std::nullopt;
    if (!there) break;
    times.push_back(end);
    measured.emplace_back(*there - *here);
  }
  if (times.empty()) return;
  MotionState<double> state;
  state.p = replays.nodes[segment].segment<3>(kStateAt);
  state.v = replays.nodes[segment].segment<3>(kStateAt + 3);
  const Vector3d start_E = state.p;
  ThetaVector parameters = replays.parameters;
  parameters.segment<kDriftSize>(kAhrsInTheta) +=
      replays.track.attitude_errors().MeanOver(start, times.back()) *
      parameters.tail<kFilterSize>();
  const ImuDrivenModel<double> equations(ImuDrivenParameters<double>::FromArray(parameters.data()),
                                         replays.log.gravity, replays.track.thrust_axis());
  const auto visit = [&](std::size_t i, const MotionState<double>& at, const Vector3<double>&) {
    const Vector3d error_E = at.p - start_E - measured[i];
    const Drive& drive = replays.track.steps()[replays.track.StepAt(times[i])].drive;
    out->push_back({segment, horizons[i], times[i], error_E, drive.R_Ep_I.transpose() * error_E});
  };
  MotionChain(replays.track, start, times).Integrate(equations, state, visit, &replays.forces);
}

// Gate of the nearest fix within a second, and the distance to it (m).
void NearestGate(const FlightLog& log, TimeNs t, const Eigen::Vector3d& p_E, ReplaySituation* at) {
  const auto after = std::ranges::lower_bound(log.fixes, t, {}, &Fix::t);
  double nearest = 1.0;  // s
  const auto consider = [&](const Fix& fix) {
    if (fix.gate < 0 || std::abs(SecondsBetween(t, fix.t)) > nearest) return;
    nearest = std::abs(SecondsBetween(t, fix.t));
    at->gate = fix.gate;
  };
  if (after != log.fixes.end()) consider(*after);
  if (after != log.fixes.begin()) consider(*std::prev(after));
  const Gate* gate = GateOf(log, at->gate);
  if (gate != nullptr) at->gate_distance = (gate->position - p_E).norm();
}

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

// The nuisance strengths, learned with the causes in the model.
YAML::Node NoiseNode(const NoiseStrengths& noise) {
  const ProcessNoise& process = noise.process;
  return FlowMap({{"fix_scale", Rounded(noise.fix_scale, 3)},
                  {"force_sigma_mps2", Rounded(noise.force_sigma, 3)},
                  {"gust_mps2", Rounded(process.gust, 3)},
                  {"gust_memory_s", Rounded(process.gust_memory, 3)},
                  {"acceleration_mps2_per_sqrt_hz", Rounded(process.acceleration, 3)},
                  {"tilt_deg", Rounded(process.tilt / kDegree, 3)},
                  {"heading_deg", Rounded(process.heading / kDegree, 3)},
                  {"memory_s", Rounded(process.memory, 3)}});
}

}  // namespace

std::vector<ReplayError> ImuDrivenFlight::ReplayOpenLoop() const {
  std::vector<ReplayError> errors;
  const Replays replays{
      log_->recorded,  plan_, fit_.x.nodes, Parameters(), BoundForces(all_, log_->recorded),
      flight_->track()};
  const std::vector<double> horizons = Horizons(log_->recorded, options_.passes);
  for (int s = 0; s < static_cast<int>(plan_.segments.size()); ++s) {
    ReplayFrom(replays, s, horizons, &errors);
  }
  return errors;
}

std::string ImuDrivenFlight::ReplaysAgainst() const {
  return log_->recorded.mocap.empty() ? "fitted path" : "mocap";
}

ReplaySituation ImuDrivenFlight::SituationOf(const ReplayError& replay) const {
  const FlightLog& log = log_->recorded;
  const FlightPlan& plan = plan_;
  const TimeNs middle = replay.end - FromSeconds(0.5 * replay.horizon);
  const int s = plan.SegmentOf(middle);
  const NodeVector& node = fit_.x.nodes[s];
  const Eigen::Vector3d p_E = node.segment<3>(kStateAt), v_E = node.segment<3>(kStateAt + 3);
  const DriveTrack& track = flight_->track();
  const Drive& drive = track.steps()[track.StepAt(middle)].drive;
  ReplaySituation at;
  at.time = SecondsBetween(log.imu.front().t, middle);
  at.speed = v_E.norm();
  if (plan.segments[s].linked) {
    const Eigen::Vector3d next = fit_.x.nodes[s + 1].segment<3>(kStateAt + 3);
    const double h = SecondsBetween(plan.segments[s].begin, plan.segments[s].end);
    at.acceleration = (next - v_E).norm() / h;
  }
  at.thrust = -drive.a_z;
  const auto imu = std::ranges::lower_bound(log.imu, middle, {}, &ImuSample::t);
  at.rate = imu == log.imu.end() ? NAN : imu->gyro.norm();
  at.heading = Heading(drive.R_Ep_I);
  NearestGate(log, middle, p_E, &at);
  at.height = -p_E.z();
  at.battery = LastBefore(log.battery, middle);
  at.north = p_E.x();
  at.east = p_E.y();
  return at;
}

PartFit ImuDrivenFlight::FitWithout(int half, const std::vector<Found>& found) const {
  Eigen::VectorXd weight = fit_.weight;
  for (int row = 0; row < weight.size(); ++row) {
    if (HalfOf(flight_->ClusterOfRow(row)) == half) weight[row] = 0.0;
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
  const DriveTrack track = DriveTrack::FromLog(corrected, log_->options.vgd.drive);
  const Replays replays{log, plan_, fit_.x.nodes, fit.value, BoundForces(fit.effects, log), track};
  std::vector<ReplayError> replayed;
  for (int s = 0; s < static_cast<int>(plan_.segments.size()); s += kReplayEvery) {
    if (HalfOf(plan_.segments[s].cluster) != half) continue;
    ReplayFrom(replays, s, {kHeldOutHorizon}, &replayed);
  }
  for (const ReplayError& r : replayed) errors.replays[r.segment] = r.error_E.norm();
  return errors;
}

HeldOutErrors ImuDrivenFlight::ErrorsHeldOut(const std::vector<Found>& found,
                                             bool with_false_data) const {
  std::array<HeldOutErrors, 2> errors;
  ParallelFor(2, 0, [&](int half) {
    const FlightLog& log = with_false_data ? log_->recorded : log_->kept;
    errors[half] = ErrorsOfHalf(log, FitWithout(half, found), half);
  });
  errors[0].arcs.merge(errors[1].arcs);
  errors[0].replays.merge(errors[1].replays);
  for (auto& [stream, of] : errors[0].streams) {
    of.by_second.merge(errors[1].streams[stream].by_second);
  }
  return errors[0];
}

Residuals ImuDrivenFlight::WhitenedResiduals() const {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  const Eigen::VectorXd sigmas = system.Whitened(system.reduced().Fitted());
  Residuals residuals;
  std::vector<TimedResidual> fixes;
  int row = 0;
  for (const std::size_t i : plan_.fixes) {
    const Fix& fix = flight_->log().fixes[i];
    residuals.rows.push_back({ToSeconds(fix.t), "fix", fix.gate, sigmas.segment<3>(row)});
    fixes.push_back({ToSeconds(fix.t), sigmas.segment<3>(row)});
    row += 3;
  }
  residuals.rms = std::sqrt(sigmas.head(row).squaredNorm() / std::max(1, row));
  for (const std::size_t i : plan_.forces) {
    residuals.rows.push_back({ToSeconds(flight_->forces()[i].t), "force", -1,
                              Eigen::Vector3d(sigmas[row], sigmas[row + 1], 0.0)});
    row += 2;
  }
  constexpr double kNeighbours = 0.3;  // s
  residuals.whiteness_p = WhitenessOf(fixes, kNeighbours);
  return residuals;
}

std::vector<ParameterEstimate> ImuDrivenFlight::Estimates() const {
  const ThetaVector value = Parameters(), sigma = Sigmas();
  std::vector<ParameterEstimate> estimates;
  for (int i = 0; i < kStatedSize; ++i) {
    estimates.push_back({kTheta[i].name, value[i], sigma[i], kTheta[i].unit, ""});
  }
  return estimates;
}

void ImuDrivenFlight::Describe(Diagnosis* diagnosis) const {
  diagnosis->parameters = Estimates();
  diagnosis->residual_of = "residual of fixes";
  diagnosis->warnings.insert(diagnosis->warnings.end(), data_.warnings.begin(),
                             data_.warnings.end());
  if (log_->continuous) diagnosis->fixes = log_->continuous->Text();
  diagnosis->noise = NoiseNode(fit_.noise);
}

}  // namespace trueline
