#include "problems/diagnosis/base_flight.h"

#include <algorithm>

#include "problems/vgd/rough_path.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

// The time at which a sample is evaluated: clamped to the segment if an effect shifted it outside.
TimeNs Clamp(TimeNs t, const FlightPlan::SegmentSpan& span) {
  return std::clamp(t, span.begin + 1, span.end);
}

}  // namespace

BaseFlight::BaseFlight(const FlightLog& log, const FlightPlan& plan, const VgdOptions& options,
                       const ForceEffects& force_effects)
    : log_(log),
      plan_(plan),
      scaling_(options),
      track_(DriveTrack::FromLog(log, options.drive)),
      forces_(SmoothForces(log.imu)) {
  BuildSegments(options);
  SetForceEffects(force_effects);
}

void BaseFlight::BuildSegments(const VgdOptions& options) {
  std::vector<std::vector<TimeNs>> times(plan_.segments.size()), force_times(times.size());
  segment_rows_.resize(times.size());
  int row = 0;
  const auto add_rows = [&](int s, int count) {
    for (int k = 0; k < count; ++k) segment_rows_[s].push_back(row++);
  };
  for (const std::size_t i : plan_.fixes) {
    const int s = plan_.SegmentOf(log_.fixes[i].t);
    fix_segment_.push_back(s);
    add_rows(s, 3);
    times[s].push_back(Clamp(log_.fixes[i].t, plan_.segments[s]));
  }
  for (const std::size_t i : plan_.forces) {
    const int s = plan_.SegmentOf(forces_[i].t);
    force_segment_.push_back(s);
    add_rows(s, 2);
    force_times[s].push_back(Clamp(forces_[i].t, plan_.segments[s]));
    times[s].push_back(force_times[s].back());
  }
  for (std::size_t s = 0; s < times.size(); ++s) {
    times[s].push_back(plan_.segments[s].end);
    std::sort(times[s].begin(), times[s].end());
    times[s].erase(std::unique(times[s].begin(), times[s].end()), times[s].end());
    segments_.push_back(std::make_unique<Segment>(track_, plan_.segments[s].begin,
                                                  std::move(times[s]), force_times[s], scaling_,
                                                  options.max_block));
  }
}

void BaseFlight::SetForceEffects(const ForceEffects& effects) {
  ForceEffects bound = effects;
  BindTerms(log_, &bound);
  for (const auto& segment : segments_) segment->SetForceEffects(bound);
}

FlightUnknowns BaseFlight::RoughStart(const std::vector<Pass>& passes) const {
  FlightUnknowns x;
  const RoughPath path(log_.fixes, passes);
  for (const auto& span : plan_.segments) {
    const LineFit guess = path.At(std::min(span.begin, path.end()));
    NodeVector node = NodeVector::Zero();
    node.segment<kStateSize>(kStateAt) << guess.p, guess.v;
    x.nodes.push_back(node);
  }
  return x;
}

FlightRows BaseFlight::Evaluate(const FlightUnknowns& x, bool derivatives) {
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    segments_[s]->Evaluate(x.theta.data(), x.nodes[s].data(), x.nodes[s].data() + kStateAt,
                           derivatives);
  }
  FlightRows result;
  result.r.setZero(rows());
  if (derivatives) {
    result.d_node.setZero(rows(), kNodeSize);
    result.d_next.setZero(rows(), kNodeSize);
    result.d_theta.setZero(rows(), kThetaSize);
  }
  for (std::size_t i = 0; i < plan_.fixes.size(); ++i) FixRow(i, x, &result);
  for (std::size_t i = 0; i < plan_.forces.size(); ++i) ForceRow(i, x, &result);
  for (std::size_t s = 0; s < segments_.size(); ++s) LinkRows(static_cast<int>(s), x, &result);
  return result;
}

namespace {

// The gusts at a segment's start and at the next segment's, or its own again if none follows.
GustPair GustsOf(const FlightPlan& plan, const FlightUnknowns& x, int s) {
  GustPair gusts;
  gusts << x.nodes[s].tail<kGustSize>(),
      x.nodes[plan.segments[s].linked ? s + 1 : s].tail<kGustSize>();
  return gusts;
}

// Adds a derivative to the segment's gusts (rows x 4) to the gusts' columns of the rows.
template <class Derivative>
void AddGusts(const FlightPlan& plan, int s, int row, const Derivative& d, FlightRows* rows) {
  const int count = static_cast<int>(d.rows());
  rows->d_node.block(row, kGustAt, count, kGustSize) += d.template leftCols<kGustSize>();
  auto& target = plan.segments[s].linked ? rows->d_next : rows->d_node;
  target.block(row, kGustAt, count, kGustSize) += d.template rightCols<kGustSize>();
}

}  // namespace

void BaseFlight::FixRow(std::size_t i, const FlightUnknowns& x, FlightRows* rows) const {
  const Fix& fix = log_.fixes[plan_.fixes[i]];
  const int s = fix_segment_[i], row = static_cast<int>(3 * i);
  const auto& span = plan_.segments[s];
  const TimeNs t = Clamp(fix.t, span);
  const StateNode& node = *segments_[s]->StateAt(t);
  const Eigen::Matrix<double, 3, 4> by_gusts = segments_[s]->StateGustsAt(t).topRows<3>();
  // A fix shifted out of the segment is extrapolated along the velocity.
  const Eigen::Vector3d beyond = node.value.tail<3>() * SecondsBetween(t, fix.t);
  const Eigen::Vector3d p = node.value.head<3>() + beyond + by_gusts * GustsOf(plan_, x, s);
  rows->r.segment<3>(row) = p - fix.p_E;
  if (rows->d_node.size() == 0) return;
  rows->d_node.block<3, kDriftSize>(row, 0) = node.d_drift().topRows<3>();
  rows->d_node.block<3, kStateSize>(row, kStateAt) = node.d_state.topRows<3>();
  rows->d_theta.middleRows<3>(row) = node.d_theta.topRows<3>();
  AddGusts(plan_, s, row, by_gusts, rows);
}

void BaseFlight::ForceRow(std::size_t i, const FlightUnknowns& x, FlightRows* rows) const {
  const ForceSample& sample = forces_[plan_.forces[i]];
  const int s = force_segment_[i];
  const int row = static_cast<int>(3 * plan_.fixes.size() + 2 * i);
  const TimeNs t = Clamp(sample.t, plan_.segments[s]);
  const ForceNode& node = *segments_[s]->ForceAt(t);
  const Eigen::Matrix<double, 2, 4> by_gusts = segments_[s]->ForceGustsAt(t);
  rows->r.segment<2>(row) = node.value + by_gusts * GustsOf(plan_, x, s) - sample.accel_xy;
  if (rows->d_node.size() == 0) return;
  rows->d_node.block<2, kDriftSize>(row, 0) = node.d_drift();
  rows->d_node.block<2, kStateSize>(row, kStateAt) = node.d_state;
  rows->d_theta.middleRows<2>(row) = node.d_theta;
  AddGusts(plan_, s, row, by_gusts, rows);
}

void BaseFlight::LinkRows(int s, const FlightUnknowns& x, FlightRows* rows) const {
  const auto& span = plan_.segments[s];
  if (!span.linked) return;
  const int row = LinkRow(s);
  const StateNode& end = *segments_[s]->end_node();
  const Eigen::Matrix<double, 6, 4> by_gusts = segments_[s]->StateGustsAt(span.end);
  const Eigen::Matrix<double, 6, 1> predicted = end.value + by_gusts * GustsOf(plan_, x, s);
  rows->r.segment<6>(row) = x.nodes[s + 1].segment<kStateSize>(kStateAt) - predicted;
  if (rows->d_node.size() == 0) return;
  rows->d_node.block<6, kDriftSize>(row, 0) = -end.d_drift();
  rows->d_node.block<6, kStateSize>(row, kStateAt) = -end.d_state;
  rows->d_next.block<6, kStateSize>(row, kStateAt).setIdentity();
  rows->d_theta.middleRows<6>(row) = -end.d_theta;
  AddGusts(plan_, s, row, -by_gusts, rows);
}

Eigen::Matrix<double, 6, 1> BaseFlight::StateAtFix(std::size_t i) const {
  const int s = fix_segment_[i];
  return segments_[s]->StateAt(Clamp(log_.fixes[plan_.fixes[i]].t, plan_.segments[s]))->value;
}

}  // namespace trueline
