#include "problems/diagnosis/base_flight.h"

#include <algorithm>

#include "cost_functions/drag_residual.h"
#include "cost_functions/fix_residual.h"
#include "problems/vgd/rough_path.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

// A fix that an effect shifted out of its segment is extrapolated along the velocity.
struct ShiftedFixError {
  FixError fix;
  double seconds;

  template <class T>
  void operator()(const T* state, T* r) const {
    T then[3];
    for (int i = 0; i < 3; ++i) then[i] = state[i] + seconds * state[3 + i];
    fix(then, r);
  }
};
using ShiftedFixResidual = NodeResidual<ShiftedFixError, 6, 6, 3>;

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
  for (const std::size_t i : plan_.fixes) {
    const auto [s, t] = PlaceOf(log_.fixes[i].t);
    times[s].push_back(t);
  }
  for (const std::size_t i : plan_.forces) {
    const auto [s, t] = PlaceOf(forces_[i].t);
    times[s].push_back(t);
    force_times[s].push_back(t);
  }
  for (std::size_t s = 0; s < times.size(); ++s) {
    times[s].push_back(plan_.segments[s].end);
    std::sort(times[s].begin(), times[s].end());
    times[s].erase(std::unique(times[s].begin(), times[s].end()), times[s].end());
    segments_.push_back(std::make_unique<Segment>(track_, plan_.segments[s].begin,
                                                  std::move(times[s]), force_times[s], scaling_,
                                                  options.max_block));
  }
  AddReadings();
}

void BaseFlight::AddReadings() {
  segment_rows_.resize(segments_.size());
  int row = 0;
  const auto add = [&](int s, auto* residual) {
    readings_.push_back({std::unique_ptr<ceres::CostFunction>(residual), s});
    for (int k = 0; k < residual->num_residuals(); ++k) segment_rows_[s].push_back(row++);
  };
  const auto gusts = [&](int s) {
    return plan_.segments[s].linked ? Gusts::kLinked : Gusts::kHeld;
  };
  for (const std::size_t i : plan_.fixes) {
    const Fix& fix = log_.fixes[i];
    const auto [s, t] = PlaceOf(fix.t);
    add(s,
        new ShiftedFixResidual(segments_[s]->StateAt(t), {{fix.p_E, 1.0}, SecondsBetween(t, fix.t)},
                               {gusts(s), segments_[s]->StateGustsAt(t)}));
  }
  for (const std::size_t i : plan_.forces) {
    const auto [s, t] = PlaceOf(forces_[i].t);
    add(s, new DragResidual(segments_[s]->ForceAt(t), {forces_[i].accel_xy, 1.0},
                            {gusts(s), segments_[s]->ForceGustsAt(t)}));
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
  FlightRows rows(this->rows(), derivatives ? this->rows() : 0);
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    segments_[s]->Evaluate(x.theta.data(), x.nodes[s].data(), x.nodes[s].data() + kStateAt,
                           derivatives);
    GustPair gusts;
    gusts << x.nodes[s].tail<kGustSize>(), NextOf(s, x).tail<kGustSize>();
    segments_[s]->AddGusts(gusts);
    if (plan_.segments[s].linked) LinkRows(static_cast<int>(s), x, &rows);
  }
  int row = 0;
  for (const Reading& reading : readings_) {
    const NodeVector &node = x.nodes[reading.segment], &next = NextOf(reading.segment, x);
    const double* blocks[] = {x.theta.data(), node.data(), node.data() + kGustAt,
                              next.data() + kGustAt};
    const auto at = [row](FlightRows::RowMatrix& d) { return d.data() + row * d.cols(); };
    double* slopes[] = {at(rows.d_theta), at(rows.d_node), at(rows.d_gust), at(rows.d_next_gust)};
    reading.residual->Evaluate(blocks, &rows.r[row], derivatives ? slopes : nullptr);
    row += reading.residual->num_residuals();
  }
  return rows;
}

void BaseFlight::LinkRows(int s, const FlightUnknowns& x, FlightRows* rows) const {
  const int row = LinkRow(s);
  const StateNode& end = *segments_[s]->end_node();
  rows->r.segment<6>(row) = x.nodes[s + 1].segment<kStateSize>(kStateAt) - end.value;
  if (rows->d_node.size() == 0) return;
  rows->d_theta.middleRows<6>(row) = -end.d_theta;
  rows->d_node.middleRows<6>(row) << -end.d_drift(), -end.d_state;
  rows->d_next.block<6, kStateSize>(row, kStateAt).setIdentity();
  const GustSlope<6> gusts{Gusts::kLinked, segments_[s]->StateGustsAt(plan_.segments[s].end)};
  rows->d_gust.middleRows<6>(row) = -gusts.Own();
  rows->d_next_gust.middleRows<6>(row) = -gusts.Next();
}

Eigen::Matrix<double, 6, 1> BaseFlight::StateAtFix(std::size_t i) const {
  const auto [s, t] = PlaceOf(log_.fixes[plan_.fixes[i]].t);
  return segments_[s]->StateAt(t)->value;
}

}  // namespace trueline
