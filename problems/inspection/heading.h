// The heading of positions against that of attitude.csv, by changes of velocity that both know.
#pragma once

#include <optional>
#include <string>

#include "problems/inspection/examination.h"

namespace trueline {

struct Heading {
  double angle;  // rad, about down: how far the positions' north is turned from the attitude's
  double sigma;  // rad; includes what an attitude filter that follows acceleration may add
  double left;   // share of the changes' square that is not explained
};

// Of mocap or of fixes, in passes or not. Velocities over short spans and what the specific force
// adds between them: dv = c (force turned to earth) + k dp + b dt, horizontal numbers as complex
// ones. c turns, k is the gain of an attitude filter that takes acceleration for tilt (its error
// over an arc goes with the displacement), b a tilt that stays; k and b have priors. None where the
// two are too unlike or arcs too few.
std::optional<Heading> HeadingOf(const FlightLog& log, const std::string& stream);

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
