// Positions with an attitude beside them: what the accelerometer is judged by.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/units.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/vector_match.h"
#include "problems/log/flight_log.h"

namespace trueline {

// An AHRS that takes acceleration for tilt (the effect ahrs_acceleration_error). Its attitude turns
// a force to earth axes too early, and turns itself at other rates than the body. So positions that
// are in time look late, and a gyroscope in order looks turned.

// 1/s, gains of an attitude filter that are tried.
inline constexpr double kLowestGain = 0.01, kHighestGain = 3.0;
// rad, by which such a filter may make the IMU seem turned.
inline constexpr double kTurnByFilter = 20.0 * kDegree;

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

struct PositionWitness {
  std::string stream;       // mocap, pose or fixes
  std::string of_attitude;  // the stream that turns the specific force to earth axes
  std::vector<AttitudeSample> attitude;
  std::vector<Bend> bends;
  double noise;  // m, usual error of a position
};

// Of the repaired log. Empty where the stream has too few positions or no attitude fits.
// `wider`: factor of the bends' width.
std::optional<PositionWitness> PositionWitnessOf(const Examination& e, const std::string& stream,
                                                 double wider = 1.0);

// Second differences of the stream's positions, as wide as their noise asks for, times `wider`.
std::vector<Bend> BendsOfStream(const FlightLog& log, const std::string& stream,
                                double wider = 1.0);

// The bends' accelerations against the specific force that an attitude turns to earth axes, as they
// are stamped, or at the best lag.
std::optional<VectorMatch> MatchBends(const FlightLog& log,
                                      const std::vector<AttitudeSample>& attitude,
                                      const std::vector<Bend>& bends,
                                      const LagSearch& search = {0.0});
// m/s^2, rms that remains once the bends are turned to where they fit the specific force best;
// infinite where they are too few.
double ResidualOfTurnedBends(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                             std::vector<Bend> bends);

// Whether an AHRS gives the witness' attitude, which may follow acceleration.
bool IsOfAhrs(const Examination& e, const PositionWitness& witness);
// The gain of such an AHRS with which the bends fit the accelerometer best, up to `reach` (s) of
// lag.
std::optional<FollowingFit> FollowingOf(const Examination& e, const PositionWitness& witness,
                                        double reach);

double RmsAcceleration(const std::vector<Bend>& bends);  // m/s^2
void TurnBends(const Eigen::Matrix3d& turn, std::vector<Bend>* bends);

// The bends in the earth of the attitude, where the two differ by a heading alone. None where they
// are too unlike to say.
std::optional<std::vector<Bend>> InEarthOfAttitude(const Examination& e,
                                                   const PositionWitness& witness);
// The bends in the axes that CheckPositions() will give the stream: those of the attitude's earth.
void TurnLikePositions(const Examination& e, const PositionWitness& witness,
                       std::vector<Bend>* bends);

}  // namespace trueline
