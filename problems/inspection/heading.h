// The heading of positions against that of attitude.csv, by changes of velocity that both know.
#pragma once

#include <optional>
#include <string>

#include "problems/inspection/examination.h"

namespace trueline {

// rad: calibration takes as much for an error of the AHRS. It does not find a larger one, and drag
// and misalignment come out wrong.
inline constexpr double kAbsorbedHeading = 6.0 * kDegree;

struct Heading {
  double angle;          // rad, about down: how far positions' north is turned from the attitude's
  double sigma;          // rad; includes what an attitude filter that follows acceleration may add
  double left;           // share of the changes' square that is not explained
  double none_excluded;  // sigmas by which a heading within kAbsorbedHeading fits worse
};

// 1/s, prior sigma of k: of an attitude filter in order, and of any filter.
inline constexpr double kOrdinaryGain = 0.05;
inline constexpr double kAnyGain = 1.0;

// Of mocap or of fixes, in passes or not. Velocities over short spans and what the specific force
// adds between them: dv = c (force turned to earth) + du + b dt + (d turned to earth), horizontal
// numbers as complex ones. c turns; |c| is 1 but for a scale. u is the velocity low-passed with
// k: an attitude filter of gain k takes its acceleration for tilt. On laps of one direction du
// looks like a turn. b is a tilt that stays, d a bias or a tilt of the IMU in the body. k, |c|, b
// and d have priors. None where the two are too unlike or arcs too few.
std::optional<Heading> HeadingOf(const FlightLog& log, const std::string& stream,
                                 double gain_sigma);

// The accelerometer's x and y exchanged or of the other sign, and z times `z`, by which changes of
// velocity are explained best without an offset of heading.
struct TurnedForce {
  Eigen::Matrix3d turn;
  Heading heading;
  bool clear;  // no other of these turns explains nearly as much
};
std::optional<TurnedForce> BestLateralTurn(const FlightLog& log, const std::string& stream,
                                           double z);

}  // namespace trueline
