// Passes (runs of fixes: the paper's straights), and the arcs between them.
#pragma once

#include <optional>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/vgd/continuous_fixes.h"

namespace trueline {

// A run of fixes without a gap longer than pass_gap: fixes[first] ... fixes[last].
struct Pass {
  std::size_t first;
  std::size_t last;
  TimeNs begin;  // time of the first fix
  TimeNs end;    // time of the last fix
};

struct PassOptions {
  double pass_gap = 0.7;  // s
  int min_fixes = 3;      // shorter runs make no pass: a position, a speed and a check
  double max_arc = 6.0;   // s; nothing is integrated over longer breaks, windows end there
  ContinuousFixOptions continuous;  // of a flight without gates
};

std::vector<Pass> FindPasses(const std::vector<Fix>& fixes, const PassOptions& options);

// Passes by time, of fixes without gates: `found.pass` long, with `found.arc` between them. A
// pause that is longer than a step between fixes is an arc, too.
std::vector<Pass> DividePasses(const std::vector<Fix>& fixes, const PassOptions& options,
                               const ContinuousFixes& found);

// True position at the end of an arc.
struct ArcTruth {
  Eigen::Vector3d p_E;  // m
  bool from_mocap;      // else the line through the next pass's first fixes
  double sigma;         // m, of each axis; zero for mocap
};

// s; mocap is interpolated between samples at most this far apart. A longer outage gives no truth.
inline constexpr double kLongestMocapGap = 0.12;

// Truth at the first fix of `next`, from mocap; empty during a mocap outage. If the log has no
// mocap, or one that is slower than that throughout, it is that of a robust line fit to the first
// fixes of `next`.
std::optional<ArcTruth> TruthAtPass(const FlightLog& log, const Pass& next);

}  // namespace trueline
