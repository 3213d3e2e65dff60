// Positions with an attitude beside them: what the accelerometer is judged by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/inspection/examination.h"
#include "problems/inspection/following_filter.h"

namespace trueline {

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
