#include <algorithm>
#include <cmath>

#include "problems/diagnosis/misfit.h"
#include "problems/trajectory/mocap_path.h"
#include "problems/window/motion_chain.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr double kMocapGap = 0.2;  // s

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
  std::nth_element(arcs.begin(), arcs.begin() + arcs.size() / 2, arcs.end());
  const double arc = arcs[arcs.size() / 2];
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
  const double h = SecondsBetween(span.begin, span.end), u = SecondsBetween(span.begin, t) / h;
  const double u2 = u * u, u3 = u2 * u;
  return (2 * u3 - 3 * u2 + 1) * p0 + (u3 - 2 * u2 + u) * h * v0 + (3 * u2 - 2 * u3) * p1 +
         (u3 - u2) * h * v1;
}

// True if the segments from `segment` to the one that holds `end` have no break between them.
bool OneStretch(const FlightPlan& plan, int segment, TimeNs end) {
  std::size_t s = static_cast<std::size_t>(segment);
  while (plan.segments[s].end < end && plan.segments[s].linked) ++s;
  return plan.segments[s].end >= end;
}

// The model of a replay. The initial states are those of the search's last Fit.
struct ReplayModel {
  ThetaVector parameters;
  ForceEffects forces;
  const DriveTrack& track;
};

std::optional<Vector3d> Measured(const CauseSearch& search, const FlightLog& log, TimeNs t) {
  if (!log.mocap.empty()) return PositionAt(log.mocap, t, kMocapGap);
  return FittedAt(search.plan(), search.fit().x.nodes, t);
}

// Replays from one knot over all `horizons` (ascending) that fit into the flight.
void ReplayFrom(const CauseSearch& search, const FlightLog& log, const ReplayModel& model,
                int segment, const std::vector<double>& horizons, std::vector<ReplayError>* out) {
  const FlightPlan& plan = search.plan();
  const TimeNs start = plan.segments[segment].begin;
  const auto here = Measured(search, log, start);
  std::vector<TimeNs> times;
  std::vector<Vector3d> measured;
  for (const double h : horizons) {
    const TimeNs end = start + FromSeconds(h);
    const bool held = OneStretch(plan, segment, end) && model.track.Covers(start, end);
    const auto there = held && here ? Measured(search, log, end) : std::nullopt;
    if (!there) break;
    times.push_back(end);
    measured.emplace_back(*there - *here);
  }
  if (times.empty()) return;
  MotionState<double> state;
  state.v = search.fit().x.nodes[segment].segment<3>(kStateAt + 3);
  const ImuDrivenModel<double> equations(
      ImuDrivenParameters<double>::FromArray(model.parameters.data()), log.gravity);
  const auto visit = [&](std::size_t i, const MotionState<double>& at, const Vector3<double>&) {
    const Vector3d error_E = at.p - measured[i];
    const Drive& drive = model.track.steps()[model.track.StepAt(times[i])].drive;
    out->push_back({segment, horizons[i], times[i], error_E, drive.R_Ep_I.transpose() * error_E});
  };
  MotionChain(model.track, start, times).Integrate(equations, state, visit, &model.forces);
}

}  // namespace

std::vector<ReplayError> ReplayOpenLoop(CauseSearch* search, const FlightLog& log) {
  std::vector<ReplayError> errors;
  const ReplayModel model{search->Parameters(), ForceEffectsOf(search->effects()),
                          search->flight().track()};
  const std::vector<double> horizons = Horizons(log, PassOptions());
  for (int s = 0; s < static_cast<int>(search->plan().segments.size()); ++s) {
    ReplayFrom(*search, log, model, s, horizons, &errors);
  }
  return errors;
}

std::vector<ReplayError> ReplayPart(const CauseSearch& search, const FlightLog& log,
                                    const FlightLog& corrected, const DriveOptions& drive,
                                    const PartFit& fit, const std::vector<int>& segments) {
  std::vector<ReplayError> errors;
  const DriveTrack track = DriveTrack::FromLog(corrected, drive);
  const ReplayModel model{fit.value, ForceEffectsOf(fit.effects), track};
  for (const int s : segments) ReplayFrom(search, log, model, s, {kReplay}, &errors);
  return errors;
}

}  // namespace trueline
