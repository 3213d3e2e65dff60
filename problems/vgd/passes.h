// Passes (runs of fixes: the paper's straights), and the arcs between them.
//
// Fixes without gates (GNSS, mocap, VIO, beacons) come without a pause, so that such a flight has
// no blind arcs of its own. It is divided by time into passes, and the arc between two passes is
// made by withholding: the window that predicts the arc uses no fix of it. Later windows use these
// fixes as past.
//
// Errors of such fixes are correlated in time, so many fixes do not average them out. The error is
// a Gauss-Markov process with the stated sigma, whose change from fix to fix is
// 2 sigma^2 (1 - exp(-dt / correlation_time)) (Brown and Hwang 2012, eq. 4.2.14), plus a white
// part. A window has the changes as its measurements, and an arc's prediction counts from the last
// fix before it. A delay of the fixes is a nuisance.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/yaml_archive.h"
#include "problems/log/flight_log.h"

namespace trueline {

enum class DivideFixes { kAuto, kNever };

struct ContinuousFixOptions {
  // kAuto: the log has no gates, and most fixes lie in runs longer than `longest_pass`.
  DivideFixes divide = DivideFixes::kAuto;
  double longest_pass = 5.0;       // s
  double arc = 3.0;                // s, withheld; less on a flight too short for five arcs
  double share = 0.5;              // of the flight that is withheld, 0 to 1
  double interval = 0.5;           // s, between the fixes that a fit uses
  double correlation_time = 60.0;  // s, of the slow part of a fix's error
  double latency = 0.0;            // s, mean of the prior of the fixes' delay
  double latency_sigma = 0.15;     // s
  double mocap_interval = 0.1;     // s, between mocap positions that serve as fixes
  double mocap_sigma = 0.01;       // m
};

void Serialize(YamlArchive* a, ContinuousFixOptions* o);

// Noise of continuous fixes.
struct FixNoise {
  double white = 0.0;             // m, sigma for each axis of the part that changes at each fix
  double correlation_time = 0.0;  // s, of the rest; 0: the rest is white, too
  double latency = 0.0;           // s, prior of the delay of the stamps: mean
  double latency_sigma = 0.0;     // s
  double longest_step = 0.0;      // s, between fixes; a longer one tells nothing of their change

  bool IsCorrelated() const { return correlation_time > 0.0; }
  // Variance (m^2, each axis) of the slow part's change over `seconds`; sigma: stated, in m.
  double WalkVariance(double sigma, double seconds) const {
    return -2.0 * sigma * sigma * std::expm1(-seconds / correlation_time);
  }
  // The same of a difference of fixes.
  double StepVariance(double sigma, double seconds) const {
    return WalkVariance(sigma, seconds) + 2.0 * white * white;
  }
};

// How the fixes of a flight without gates were treated.
struct ContinuousFixes {
  bool from_mocap = false;
  double rate = 0.0;  // Hz, as logged
  double arc = 0.0;   // s
  double pass = 0.0;  // s
  FixNoise noise;

  // "the fixes are continuous (5 Hz): time divides the flight into arcs of 3 s, ..."
  std::string Text() const;
};

// Empty for a log with gates, or with pauses between its fixes.
std::optional<ContinuousFixes> FindContinuousFixes(const FlightLog& log,
                                                   const ContinuousFixOptions& options);

// The log with the fixes that a fit uses: those of the log or of mocap, `interval` apart, within
// the time of IMU and attitude, without rest on the ground before and after the flight. The log
// itself may be the result of this function.
std::shared_ptr<const FlightLog> WithFixesToFit(const FlightLog& log,
                                                const ContinuousFixOptions& options,
                                                const ContinuousFixes& found);

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
