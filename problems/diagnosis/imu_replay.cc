// Open-loop replays of the IMU-driven model.
#include <algorithm>
#include <cmath>
#include <limits>

#include "cost_functions/models/cubic_path.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/misfit.h"
#include "problems/log/fixes.h"
#include "problems/result/statistics.h"
#include "problems/trajectory/mocap_path.h"
#include "problems/vgd/motion_chain.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Horizons from a quarter of a second to the median arc between passes.
std::vector<double> Horizons(const FlightLog& log, const PassOptions& options) {
  std::vector<double> horizons = {0.25, 0.5, 1.0, 2.0};
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

std::vector<ReplayError> ImuDrivenFlight::ReplayPart(const FlightLog& log,
                                                     const FlightLog& corrected, const PartFit& fit,
                                                     const std::vector<int>& segments) const {
  std::vector<ReplayError> errors;
  const DriveTrack track = DriveTrack::FromLog(corrected, log_->options.vgd.drive);
  const Replays replays{log, plan_, fit_.x.nodes, fit.value, BoundForces(fit.effects, log), track};
  for (const int s : segments) ReplayFrom(replays, s, {kReplaySeconds}, &errors);
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
  ReplaySituation at{};
  at.time = SecondsBetween(log.imu.front().t, middle);
  at.speed = v_E.norm();
  if (plan.segments[s].linked) {
    const Eigen::Vector3d next = fit_.x.nodes[s + 1].segment<3>(kStateAt + 3);
    const double h = SecondsBetween(plan.segments[s].begin, plan.segments[s].end);
    at.acceleration = (next - v_E).norm() / h;
  }
  at.thrust = -drive.a_z;
  const auto imu = std::ranges::lower_bound(log.imu, middle, {}, &ImuSample::t);
  at.rate = imu == log.imu.end() ? kNone : imu->gyro.norm();
  at.heading = Heading(drive.R_Ep_I);
  at.gate = -1;
  at.gate_distance = kNone;
  NearestGate(log, middle, p_E, &at);
  at.height = -p_E.z();
  at.battery = LastBefore(log.battery, middle);
  at.north = p_E.x();
  at.east = p_E.y();
  return at;
}

}  // namespace trueline
