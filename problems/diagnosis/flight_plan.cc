#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/diagnosis/base_flight.h"

namespace trueline {
namespace {

constexpr double kMargin = 0.3;   // s, around passes: effects move fixes and attitude in time
constexpr int kMinClusters = 4;   // fewer clusters give no usable scatter
constexpr double kCluster = 2.0;  // s; a longer run of fixes (mocap) gives several clusters

struct Stretch {
  TimeNs begin, end;
};

// Joins passes that can be integrated through to stretches.
std::vector<Stretch> FindStretches(const FlightData& flight) {
  std::vector<Stretch> stretches;
  const TimeNs margin = FromSeconds(kMargin);
  for (std::size_t i = 0; i < flight.passes.size(); ++i) {
    const Pass& pass = flight.passes[i];
    if (i > 0 && flight.HasArc(static_cast<int>(i)) && !stretches.empty()) {
      stretches.back().end = pass.end;
    } else {
      stretches.push_back({pass.begin, pass.end});
    }
  }
  for (Stretch& s : stretches) {
    TimeNs begin = std::max(s.begin - margin, flight.track.begin() + margin);
    TimeNs end = std::min(s.end + margin, flight.track.end() - margin);
    for (const TimeSpan& gap : flight.track.gaps()) {
      if (gap.end <= s.begin) begin = std::max(begin, gap.end);
      if (gap.begin >= s.end) end = std::min(end, gap.begin);
    }
    s = {begin, end};
  }
  std::erase_if(stretches, [&](const Stretch& s) {
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

// There is mocap, and it is not among the fixes (gate -1) already.
bool MayFitToMocap(const FlightLog& log) {
  const bool is_fitted =
      std::any_of(log.fixes.begin(), log.fixes.end(), [](const Fix& fix) { return fix.gate < 0; });
  return !log.mocap.empty() && !is_fitted;
}

}  // namespace

FlightPlan FlightPlan::For(const FlightData& flight, const VgdOptions& options) {
  FlightPlan plan;
  plan.cluster_starts = ClusterStarts(flight);
  const std::vector<ForceSample> forces = SmoothForces(flight.log.imu);
  plan.clusters = static_cast<int>(plan.cluster_starts.size());
  const auto add_inside = [&](const Stretch& s, const auto& samples, auto* indices, auto* cluster) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (samples[i].t <= s.begin || samples[i].t >= s.end) continue;
      indices->push_back(i);
      cluster->push_back(plan.ClusterAt(samples[i].t));
    }
  };
  for (const Stretch& s : FindStretches(flight)) {
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
  if (plan.clusters < kMinClusters || plan.segments.empty()) {
    throw NoUsableResult(fmt::format(
        "{}: {} passes of fixes are too few for a diagnosis, which needs {} or more; "
        "fly more laps{}",
        flight.log.directory, plan.clusters, kMinClusters,
        MayFitToMocap(flight.log) ? ", or fit to mocap (--fit_to=mocap) if it covers more"
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
