// An AHRS that takes acceleration for tilt (the effect ahrs_acceleration_error). Its attitude turns
// a force to earth axes too early, and turns itself at other rates than the body. So positions that
// are in time look late, and a gyroscope in order looks turned.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "problems/common/units.h"
#include "problems/inspection/vector_match.h"
#include "problems/log/flight_log.h"

namespace trueline {

// 1/s, gains of an attitude filter that are tried.
inline constexpr double kLowestGain = 0.01, kHighestGain = 3.0;
// rad, by which such a filter may make the IMU seem turned.
inline constexpr double kTurnByFilter = 20.0 * kDegree;

// 1 - correlation^2, the share of a signal's square that a match leaves.
inline double RestOf(double correlation) { return 1.0 - correlation * correlation; }

// `attitude` without the tilt of a filter of this gain (1/s). The tilt times gravity follows the
// acceleration, d(tilt)/dt = gain (a - tilt), and a force that is turned by it reads a - tilt.
std::vector<AttitudeSample> WithoutFollowing(const FlightLog& log,
                                             const std::vector<AttitudeSample>& attitude,
                                             double gain);

struct FollowingFit {
  double gain;  // 1/s
  VectorMatch match;
};

using MatchOfAttitude =
    std::function<std::optional<VectorMatch>(const std::vector<AttitudeSample>&)>;

// The gain from 0.01 to 3 1/s without which `of` leaves the least rest: by its correlation, or by
// the correlation without a turn (`unturned`).
std::optional<FollowingFit> FitFollowing(const FlightLog& log,
                                         const std::vector<AttitudeSample>& attitude,
                                         const MatchOfAttitude& of, double VectorMatch::*by);

}  // namespace trueline
