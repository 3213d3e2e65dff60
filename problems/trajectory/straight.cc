#include "problems/trajectory/straight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

constexpr double kSameHeading = M_PI / 4.0;  // rad

double HeadingOf(const Eigen::Vector3d& v) { return std::atan2(v.y(), v.x()); }

double AngleBetween(double a, double b) { return std::abs(std::remainder(a - b, 2.0 * M_PI)); }

bool Inside(const StraightBox& box, const Eigen::Vector3d& p, const Eigen::Vector3d& v) {
  if ((p.array() < box.low.array()).any() || (p.array() > box.high.array()).any()) return false;
  return !box.heading || AngleBetween(HeadingOf(v), *box.heading) < kSameHeading;
}

// The runs of samples for which `inside` holds, without gaps.
template <class Predicate>
std::vector<PathRun> RunsWhere(const std::vector<PoseSample>& mocap, double max_gap,
                               const Predicate& inside) {
  std::vector<PathRun> runs;
  bool open = false;
  for (std::size_t i = 0; i < mocap.size(); ++i) {
    const bool gap = i > 0 && SecondsBetween(mocap[i - 1].t, mocap[i].t) > max_gap;
    const bool now = inside(i);
    if (now && (!open || gap)) runs.push_back({i, i});
    if (now) runs.back().last = i;
    open = now;
  }
  return runs;
}

// Ends of a straight, before it has a gate.
struct Ends {
  TimeNs from, to;
  Eigen::Vector3d start, end;  // m, E

  double heading() const { return HeadingOf(end - start); }
};

bool LongEnough(const Ends& ends, const StraightLimits& limits) {
  return (ends.end - ends.start).head<2>().norm() >= limits.min_length;
}

// The flights that share a gate.
struct Group {
  Eigen::Vector3d end_sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_sum = Eigen::Vector3d::Zero();
  int count = 0;

  void Add(const Ends& ends) {
    end_sum += ends.end;
    direction_sum += (ends.end - ends.start).normalized();
    ++count;
  }
  Gate AsGate(int id) const { return {id, end_sum / count, HeadingOf(direction_sum)}; }
};

int GroupOf(const Ends& ends, double gate_distance, std::vector<Group>* groups) {
  for (std::size_t k = 0; k < groups->size(); ++k) {
    const Gate gate = (*groups)[k].AsGate(0);
    if (AngleBetween(ends.heading(), gate.yaw) > kSameHeading) continue;
    if ((ends.end - gate.position).norm() > gate_distance) continue;
    return static_cast<int>(k);
  }
  groups->emplace_back();
  return static_cast<int>(groups->size()) - 1;
}

std::vector<Straight> WithGates(std::vector<Ends> all, const StraightLimits& limits) {
  std::sort(all.begin(), all.end(), [](const Ends& a, const Ends& b) { return a.from < b.from; });
  std::vector<Group> groups;
  std::vector<std::size_t> group_of;
  for (const Ends& ends : all) {
    const int k = GroupOf(ends, limits.gate_distance, &groups);
    group_of.push_back(static_cast<std::size_t>(k));
    groups[group_of.back()].Add(ends);
  }
  std::vector<Straight> straights;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Gate gate = groups[group_of[i]].AsGate(static_cast<int>(group_of[i]));
    straights.push_back({all[i].from, all[i].to, gate});
  }
  return straights;
}

}  // namespace

std::vector<Straight> StraightsInBoxes(const std::vector<PoseSample>& mocap,
                                       const std::vector<StraightBox>& boxes,
                                       const StraightLimits& limits) {
  const std::vector<Eigen::Vector3d> velocity = PathVelocity(mocap);
  std::vector<Ends> all;
  for (const StraightBox& box : boxes) {
    const auto inside = [&](std::size_t i) {
      return velocity[i].head<2>().norm() >= limits.min_speed &&
             Inside(box, mocap[i].p_E, velocity[i]);
    };
    for (const PathRun& run : RunsWhere(mocap, limits.max_gap, inside)) {
      const PoseSample& first = mocap[run.first];
      const PoseSample& last = mocap[run.last];
      const Ends ends{first.t, last.t, first.p_E, last.p_E};
      if (LongEnough(ends, limits)) all.push_back(ends);
    }
  }
  return WithGates(std::move(all), limits);
}

std::vector<Straight> FindStraights(const std::vector<PoseSample>& mocap,
                                    const CurvatureOptions& options, const StraightLimits& limits) {
  const std::vector<Eigen::Vector3d> velocity = PathVelocity(mocap);
  const auto moving = [&](std::size_t i) {
    return velocity[i].head<2>().norm() >= limits.min_speed;
  };
  std::vector<ResampledPath> paths;
  for (const PathRun& run : RunsWhere(mocap, limits.max_gap, moving)) {
    paths.push_back(ResampleByLength(mocap, run, options.chord));
  }
  const double threshold = CurvatureThreshold(paths, options);
  std::vector<Ends> all;
  for (const ResampledPath& path : paths) {
    for (const PathRun& run : FlatRuns(path, threshold, options.merge_gap)) {
      const ResampledPoint& first = path.points[run.first];
      const ResampledPoint& last = path.points[run.last];
      const Ends ends{first.t, last.t, first.p_E, last.p_E};
      if (LongEnough(ends, limits)) all.push_back(ends);
    }
  }
  return WithGates(std::move(all), limits);
}

std::vector<Gate> GatesOf(const std::vector<Straight>& straights) {
  std::map<int, Gate> gates;
  for (const Straight& straight : straights) gates.emplace(straight.gate.id, straight.gate);
  std::vector<Gate> sorted;
  sorted.reserve(gates.size());
  for (const auto& [id, gate] : gates) sorted.push_back(gate);
  return sorted;
}

namespace {

constexpr int kStepsPerChord = 8;
constexpr TimeNs kSmoothing = kNsPerSecond / 20;  // either side

// Mean position of the samples within the smoothing window about each sample of the run.
std::vector<Eigen::Vector3d> Smoothed(const std::vector<PoseSample>& mocap, const PathRun& run) {
  std::vector<Eigen::Vector3d> smooth;
  for (std::size_t i = run.first; i <= run.last; ++i) {
    Eigen::Vector3d sum = mocap[i].p_E;
    int count = 1;
    // Equally many on both sides; otherwise smoothing would pull the ends inwards.
    for (std::size_t k = 1; i >= run.first + k && i + k <= run.last; ++k) {
      if (mocap[i + k].t - mocap[i].t > kSmoothing) break;
      if (mocap[i].t - mocap[i - k].t > kSmoothing) break;
      sum += mocap[i - k].p_E + mocap[i + k].p_E;
      count += 2;
    }
    smooth.push_back(sum / count);
  }
  return smooth;
}

double TurnBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.x() * b.x() + a.y() * b.y());
}

void SetCurvature(double chord, std::vector<ResampledPoint>* points) {
  const auto count = static_cast<int>(points->size());
  const auto at = [&](int i) -> ResampledPoint& { return (*points)[static_cast<std::size_t>(i)]; };
  for (int i = kStepsPerChord; i + kStepsPerChord < count; ++i) {
    const Eigen::Vector3d before = at(i).p_E - at(i - kStepsPerChord).p_E;
    const Eigen::Vector3d after = at(i + kStepsPerChord).p_E - at(i).p_E;
    at(i).curvature = TurnBetween(before, after) / chord;
  }
}

}  // namespace

ResampledPath ResampleByLength(const std::vector<PoseSample>& mocap, const PathRun& run,
                               double chord) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  ResampledPath path{chord / kStepsPerChord, {}};
  const std::vector<Eigen::Vector3d> smooth = Smoothed(mocap, run);
  double to_next = 0.0;  // m along the path to the next point
  for (std::size_t i = 1; i < smooth.size(); ++i) {
    const Eigen::Vector3d& p = smooth[i - 1];
    const double length = (smooth[i] - p).head<2>().norm();
    const TimeNs t = mocap[run.first + i - 1].t;
    const auto span = static_cast<double>(mocap[run.first + i].t - t);
    while (to_next < length) {
      const double share = to_next / length;
      const Eigen::Vector3d point = p + share * (smooth[i] - p);
      path.points.push_back({t + std::llround(share * span), point, kUnknown});
      to_next += path.step;
    }
    to_next -= length;
  }
  SetCurvature(chord, &path.points);
  return path;
}

double CurvatureThreshold(const std::vector<ResampledPath>& paths,
                          const CurvatureOptions& options) {
  std::vector<double> curvature;
  for (const ResampledPath& path : paths) {
    for (const ResampledPoint& point : path.points) {
      if (std::isfinite(point.curvature)) curvature.push_back(std::abs(point.curvature));
    }
  }
  if (curvature.empty() || options.flattest_share <= 0.0) return options.max_curvature;
  const double rank = std::min(options.flattest_share, 1.0) * static_cast<double>(curvature.size());
  const std::size_t k = std::min(static_cast<std::size_t>(rank), curvature.size() - 1);
  std::nth_element(curvature.begin(), curvature.begin() + static_cast<std::ptrdiff_t>(k),
                   curvature.end());
  return std::max(options.max_curvature, curvature[k]);
}

std::vector<PathRun> FlatRuns(const ResampledPath& path, double threshold, double merge_gap) {
  std::vector<PathRun> runs;
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    if (!(std::abs(path.points[i].curvature) <= threshold)) continue;  // not a number: no
    const bool joins =
        !runs.empty() && static_cast<double>(i - runs.back().last - 1) * path.step <= merge_gap;
    if (!joins) runs.push_back({i, i});
    runs.back().last = i;
  }
  return runs;
}

}  // namespace trueline
