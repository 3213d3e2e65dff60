// Straights of a flown course: where a gate is in view, between the turns (Li et al. 2019, fig. 6).
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// One flight along a straight. Its gate is at the end, so the distance to it decreases. Straights
// flown at the same place in the same direction share their gate.
struct Straight {
  TimeNs from;
  TimeNs to;
  Gate gate;
};

// Limits of a straight, for both ways of finding them.
struct StraightLimits {
  double min_speed = 0.3;       // m/s, horizontal; slower flight belongs to no straight
  double min_length = 0.8;      // m, between its ends
  double max_gap = 0.3;         // s without mocap that ends a straight
  double gate_distance = 0.75;  // m between the ends of straights that share a gate, at most
};

// A given straight: all flight within a box of E, and in a direction if one is given.
struct StraightBox {
  static constexpr double kOpen = std::numeric_limits<double>::infinity();
  Eigen::Vector3d low{-kOpen, -kOpen, -kOpen};  // m
  Eigen::Vector3d high{kOpen, kOpen, kOpen};    // m
  std::optional<double> heading;                // rad in E, within 45 deg
};

struct CurvatureOptions {
  double max_curvature = 0.3;   // 1/m of the path seen from above; a turn is sharper
  double flattest_share = 0.0;  // of the path's length that is accepted above max_curvature too
  double chord = 0.4;           // m, the length over which a direction is measured
  double merge_gap = 0.15;      // m of sharper path that does not end a straight
};

// In the order of time, with gates numbered from 0 in the order of their first passage.
std::vector<Straight> StraightsInBoxes(const std::vector<PoseSample>& mocap,
                                       const std::vector<StraightBox>& boxes,
                                       const StraightLimits& limits);
std::vector<Straight> FindStraights(const std::vector<PoseSample>& mocap,
                                    const CurvatureOptions& options, const StraightLimits& limits);

// The gates of all straights, each once, by rising id.
std::vector<Gate> GatesOf(const std::vector<Straight>& straights);

// Curvature of a flown path seen from above, by path length instead of time: independent of speed,
// and without noisy second derivatives.
struct PathRun {
  std::size_t first, last;  // both included
};

struct ResampledPoint {
  TimeNs t;
  Eigen::Vector3d p_E;  // m
  double curvature;     // 1/m, horizontal, positive to the right (NED); not a number near the ends
};

struct ResampledPath {
  double step;  // m between points
  std::vector<ResampledPoint> points;
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
