#include "problems/inspection/align_mocap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/motion.h"
#include "problems/inspection/position_witness.h"
#include "problems/log/attitude_cursor.h"

namespace trueline {
namespace {

constexpr double kBendWidth = 0.2;          // s, half the width of a second difference
constexpr LagSearch kWithin = {0.5, 0.01};  // s
constexpr double kOrdinaryLag = 0.004;      // s

std::optional<VectorMatch> MocapAgainstForce(const FlightLog& log) {
  if (log.mocap.empty() || log.attitude.empty()) return std::nullopt;
  const auto bends = BendsOf(PositionsOf(log.mocap), LogClock(log), kBendWidth, kMostPairs);
  return MatchBends(log, log.attitude, bends, kWithin);
}

// Mocap of positions alone has the logged attitude in place of one of its own.
void CopyAttitude(FlightLog* log) {
  constexpr double kAnyGap = 1e9;  // s
  AttitudeCursor cursor(log->attitude);
  for (PoseSample& pose : log->mocap) cursor.At(pose.t, kAnyGap, &pose.q_E);
}

// A shift suits one time of a flight only where the clock drifts.
std::string DriftText(const FlightLog& log, const VectorMatch& match) {
  if (std::abs(match.drift) < std::max(kOrdinaryDrift, kShown * match.drift_sigma)) return "";
  return fmt::format(
      "mocap: its clock drifts by {:+.2e} s/s +- {:.1e} s/s against the IMU's, which a constant "
      "shift does not correct: {}",
      match.drift, match.drift_sigma, DriftRemedy(log, match.drift));
}

std::string Joined(const std::string& a, const std::string& b) {
  return a.empty() || b.empty() ? a + b : a + ". " + b;
}

}  // namespace

std::string AlignMocap(bool sampled_fixes, FlightLog* log) {
  const std::optional<VectorMatch> match = MocapAgainstForce(*log);
  if (!match || match->correlation < kAlike) return "";
  std::string drift = DriftText(*log, *match);
  if (match->or_else) return drift;
  if (std::abs(match->lag) < std::max(kOrdinaryLag, kShown * match->lag_sigma)) return drift;
  const TimeNs shift = FromSeconds(match->lag);
  const bool copy = RepeatsAttitude(*log, AttitudesOf(log->mocap));
  for (PoseSample& pose : log->mocap) pose.t -= shift;
  if (copy) CopyAttitude(log);
  if (sampled_fixes) {
    for (Fix& fix : log->fixes) fix.t -= shift;
  }
  const std::string moved = fmt::format(
      "mocap: its stamps are moved by {:+.3f} s +- {:.3f} s onto the IMU's clock, as `mocap_clock: "
      "imu` asks (correlation with the accelerometer {:.3f}, as stamped {:.3f})",
      -match->lag, match->lag_sigma, match->correlation, match->unshifted);
  return Joined(moved, drift);
}

}  // namespace trueline
