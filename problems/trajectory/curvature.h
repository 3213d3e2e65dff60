// Curvature of a flown path seen from above, by path length instead of time: independent of speed,
// and without noisy second derivatives.
#pragma once

#include <vector>

#include "problems/trajectory/straight.h"

namespace trueline {

struct PathRun {
  std::size_t first, last;  // both included
};

struct PathPoint {
  TimeNs t;
  Eigen::Vector3d p_E;  // m
  double curvature;     // 1/m, horizontal, positive to the right (NED); not a number near the ends
};

struct ResampledPath {
  double step;  // m between points
  std::vector<PathPoint> points;
};

// The run's path, smoothed over 0.1 s, in steps of an eighth of `chord` (m); curvature is the turn
// between the chords before and after a point over their length.
ResampledPath ResampleByLength(const std::vector<PoseSample>& mocap, const PathRun& run,
                               double chord);

// The larger of max_curvature and the flattest_share quantile of curvature by path length.
double CurvatureThreshold(const std::vector<ResampledPath>& paths, const CurvatureOptions& options);

// Runs of points no sharper than `threshold`, joined over gaps of up to `merge_gap` (m).
std::vector<PathRun> FlatRuns(const ResampledPath& path, double threshold, double merge_gap);

}  // namespace trueline
