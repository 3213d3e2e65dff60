// What all steps of an inspection call alike, clear and apart.
#pragma once

#include <cstddef>

#include "problems/common/units.h"

namespace trueline {

inline constexpr double kAlike = 0.7;   // correlation above which two streams show one motion
inline constexpr double kSound = 0.85;  // below it they are of two flights, or one sensor is bad
inline constexpr double kGood = 0.95;   // above it both sensors are good
inline constexpr double kCovers = 0.8;  // share of one stream that must lie in the time of another
inline constexpr double kShown = 5.0;   // sigmas of what is shown
inline constexpr double kLikely = 3.0;  // sigmas by which one explanation is likelier than another
inline constexpr double kOtherScale = 0.05;  // a smaller one of a sensor is no fault
inline constexpr double kMuchLess = 0.75;    // of a residual that another explanation leaves
inline constexpr double kExplains = 0.8;     // of the rest that a simpler explanation leaves
inline constexpr double kAlikeRest = 1.1;    // ratio of the rests of two that explain alike
inline constexpr double kOtherAxes = 10.0 * kDegree;  // a smaller turn is a misalignment
inline constexpr double kBodyBias = 0.3;     // m/s^2, prior sigma: a bias, and a tilt by 1.5 deg
inline constexpr double kForceError = 0.4;   // m/s^2; a residual may be drag or a bias by as much
inline constexpr double kAttitudeGap = 0.3;  // s, over which an attitude is not interpolated
inline constexpr double kLeastPositionLag = 0.02;  // s, of positions or rotors
inline constexpr double kHarmless = 0.1;  // s; a shorter stretch without measurements harms no fit
inline constexpr std::size_t kFewest = 30;       // samples or pairs that show anything
inline constexpr int kBlocks = 10;               // of a flight, whose scatter gives sigmas
inline constexpr std::size_t kMostPairs = 1500;  // of two streams

}  // namespace trueline
