// What all steps of an inspection call alike, clear and apart.
#pragma once

#include <cstddef>

#include "problems/common/units.h"

namespace trueline {

// Correlations of two streams, or cosines.
inline constexpr double kAlike = 0.7;   // above it two streams show one motion
inline constexpr double kSound = 0.85;  // below it they are of two flights, or one sensor is bad
inline constexpr double kGood = 0.95;   // above it both sensors are good

inline constexpr double kClearly = 0.02;  // by which one is better than another

// Shares of rows, of time, of a size or of its square.
inline constexpr double kHardly = 0.05;  // as good as none
inline constexpr double kLittle = 0.3;
inline constexpr double kMajority = 0.5;
inline constexpr double kMostly = 0.8;  // ... all of it, but for the ends

// Ratios of what two explanations leave.
inline constexpr double kExplains = 0.8;   // of the rest that a simpler explanation leaves
inline constexpr double kAlikeRest = 1.1;  // of two that explain alike

inline constexpr double kShown = 5.0;   // sigmas of what is shown
inline constexpr double kLikely = 3.0;  // sigmas by which one explanation is likelier than another

// Sizes that are no fault.
inline constexpr double kOtherScale = 0.05;  // of a sensor
inline constexpr double kOtherUnit = 0.2;    // logarithm: no sensor's own scale is so far off
inline constexpr double kOtherAxes = 10.0 * kDegree;  // a misalignment
inline constexpr double kClearTurn = 30.0 * kDegree;  // what looks like turned axes
inline constexpr double kBodyBias = 0.3;      // m/s^2, prior sigma: a bias, and a tilt by 1.5 deg
inline constexpr double kForceError = 0.4;    // m/s^2; a residual may be drag or a bias by as much
inline constexpr double kForceNoise = 0.05;   // m/s^2, least error of a mean specific force
inline constexpr double kErrorOfMean = 0.02;  // of gravity, by the mean force in earth axes
inline constexpr double kMovingRate = 0.2;    // rad/s, of a vehicle that is not at rest
inline constexpr double kFarLag = 1.0;        // s, that no latency makes
inline constexpr double kNearLag = 0.5;       // s: two lags that are one peak, or those of a sensor
inline constexpr double kHarmless = 0.1;  // s; a shorter stretch without measurements harms no fit

// Smallest lag (s) and drift (s/s) of a stream's clock that are a fault. No clock of quartz is as
// far off as that of places; errors of a map, gate by gate, look like a drift of fixes.
struct ClockSizes {
  double lag, drift;
};
inline constexpr ClockSizes kTurnClock = {0.012, 1e-4}, kPlaceClock = {0.02, 1e-3},
                            kFixClock = {0.02, 5e-3};

// Of accelerometer (m/s^2) and gyroscope (rad/s).
struct SensorSizes {
  double still;    // standard deviation at rest
  double calm;     // from gravity, or from zero, in calm flight
  double spike;    // a smaller one is none
  double harmful;  // change of speed (m/s) or turn (rad) by the single sample that a spike is
  double quiet;    // of 1/sqrt(Hz): the best MEMS sensors have more noise
};
inline constexpr SensorSizes kAccelerometer = {0.1, 1.5, 5.0, 0.3, 3e-4};
inline constexpr SensorSizes kGyroscope = {0.03, 0.5, 1.0, 0.02, 2e-5};

inline constexpr double kLongStep = 5.0;     // median steps that make a gap
inline constexpr double kAttitudeGap = 0.3;  // s, over which an attitude is not interpolated
inline constexpr double kFineStep = 0.01, kCoarseStep = 0.05;  // s, of searches and integrals
inline constexpr std::size_t kFewest = 30;        // samples or pairs that show anything
inline constexpr std::size_t kFewestOfPart = 10;  // of a part of a flight
inline constexpr int kBlocks = 10;                // of a flight, whose scatter gives sigmas
inline constexpr std::size_t kMostPairs = 1500;   // of two streams

}  // namespace trueline
