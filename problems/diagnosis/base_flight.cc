#include "problems/diagnosis/base_flight.h"

#include <fmt/format.h>

#include <cmath>

#include "cost_functions/drag_residual.h"
#include "cost_functions/fix_residual.h"
#include "problems/common/error.h"
#include "problems/diagnosis/agreement.h"
#include "problems/diagnosis/thresholds.h"
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

constexpr double kCluster = 2.0;  // s; a longer run of fixes (mocap) gives several clusters

// Joins passes that can be integrated through to stretches.
std::vector<TimeSpan> FindStretches(const FlightData& flight) {
  std::vector<TimeSpan> stretches;
  const TimeNs margin = FromSeconds(kMovedBy);
  for (std::size_t i = 0; i < flight.passes.size(); ++i) {
    const Pass& pass = flight.passes[i];
    if (i > 0 && flight.HasArc(static_cast<int>(i)) && !stretches.empty()) {
      stretches.back().end = pass.end;
    } else {
      stretches.push_back({pass.begin, pass.end});
    }
  }
  for (TimeSpan& s : stretches) {
    TimeNs begin = std::max(s.begin - margin, flight.track.begin() + margin);
    TimeNs end = std::min(s.end + margin, flight.track.end() - margin);
    for (const TimeSpan& gap : flight.track.gaps()) {
      if (gap.end <= s.begin) begin = std::max(begin, gap.end);
      if (gap.begin >= s.end) end = std::min(end, gap.begin);
    }
    s = {begin, end};
  }
  std::erase_if(stretches, [&](const TimeSpan& s) {
    return SecondsBetween(s.begin, s.end) < 1.0 || !flight.track.Covers(s.begin, s.end);
  });
  return stretches;
}

std::vector<TimeNs> ClusterStarts(const FlightData& flight) {
  std::vector<TimeNs> starts;
  for (const Pass& pass : flight.passes) {
    const double length = SecondsBetween(pass.begin, pass.end);
    const int pieces = std::max(1, static_cast<int>(length / kCluster));
    for (int k = 0; k < pieces; ++k) {
      starts.push_back(pass.begin + (pass.end - pass.begin) * k / pieces);
    }
  }
  return starts;
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

FlightPlan FlightPlan::For(const FlightData& flight, const VgdOptions& options) {
  FlightPlan plan;
  plan.cluster_starts = ClusterStarts(flight);
  const std::vector<ForceSample> forces = SmoothForces(flight.log.imu);
  plan.clusters = static_cast<int>(plan.cluster_starts.size());
  const auto add_inside = [&](const TimeSpan& s, const auto& samples, auto* indices,
                              auto* cluster) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (samples[i].t <= s.begin || samples[i].t >= s.end) continue;
      indices->push_back(i);
      cluster->push_back(plan.ClusterAt(samples[i].t));
    }
  };
  for (const TimeSpan& s : FindStretches(flight)) {
    const double seconds = SecondsBetween(s.begin, s.end);
    const int count = std::max(1, static_cast<int>(std::ceil(seconds / options.knot_interval)));
    for (int k = 0; k < count; ++k) {
      const TimeNs from = s.begin + (s.end - s.begin) * k / count;
      const TimeNs to = s.begin + (s.end - s.begin) * (k + 1) / count;
      plan.segments.push_back({from, to, k + 1 < count, plan.ClusterAt(to)});
    }
    add_inside(s, flight.log.fixes, &plan.fixes, &plan.fix_cluster);
    if (options.drag_measurement.enabled) {
      add_inside(s, forces, &plan.forces, &plan.force_cluster);
    }
  }
  if (plan.clusters <= kBlockClusters || plan.segments.empty()) {
    const bool may_fit_to_mocap = !flight.log.mocap.empty() && !IsFittedToMocap(flight.log);
    throw NoUsableResult(
        fmt::format("{}: {} passes of fixes are too few for a diagnosis, which needs {} or more; "
                    "fly more laps{}",
                    flight.log.directory, plan.clusters, kBlockClusters + 1,
                    may_fit_to_mocap ? ", or fit to mocap (--fit_to=mocap) if it covers more"
                                     : ", or log attitude and positions for the whole flight"));
  }
  return plan;
}

int FlightPlan::ClusterAt(TimeNs t) const {
  const auto after = std::upper_bound(cluster_starts.begin(), cluster_starts.end(), t);
  return std::max(0, static_cast<int>(after - cluster_starts.begin()) - 1);
}

int FlightPlan::SegmentOf(TimeNs t) const {
  const auto it = std::ranges::lower_bound(segments, t, {}, &SegmentSpan::end);
  return it == segments.end() ? static_cast<int>(segments.size()) - 1
                              : static_cast<int>(it - segments.begin());
}

}  // namespace trueline
