#include "problems/trajectory/curvature.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trueline {
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

void SetCurvature(double chord, std::vector<PathPoint>* points) {
  const auto count = static_cast<int>(points->size());
  const auto at = [&](int i) -> PathPoint& { return (*points)[static_cast<std::size_t>(i)]; };
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
    for (const PathPoint& point : path.points) {
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
