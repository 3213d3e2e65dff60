// What all steps of an inspection call alike, clear and apart.
#pragma once

#include <cstddef>

#include "problems/common/units.h"

namespace trueline {

inline constexpr double kAlike = 0.7;   // correlation above which two streams show one motion
inline constexpr double kSound = 0.85;  // below it they are of two flights, or one sensor is bad
inline constexpr double kCovers = 0.8;  // share of one stream that must lie in the time of another
inline constexpr double kShown = 5.0;   // sigmas of what is shown
inline constexpr double kLikely = 3.0;  // sigmas by which one explanation is likelier than another
inline constexpr double kOtherScale = 0.05;  // a smaller one of a sensor is no fault
inline constexpr double kMuchLess = 0.75;    // of a residual that another explanation leaves
inline constexpr double kExplains = 0.8;     // of the rest that a simpler explanation leaves
inline constexpr double kAlikeRest = 1.1;    // ratio of the rests of two that explain alike
inline constexpr double kOtherAxes = 10.0 * kDegree;  // a smaller turn is a misalignment
inline constexpr double kOtherBody = 8.0 * kDegree;   // the same of a body's axes, set by hand
inline constexpr double kAttitudeGap = 0.3;      // s, over which an attitude is not interpolated
inline constexpr int kBlocks = 10;               // of a flight, whose scatter gives sigmas
inline constexpr std::size_t kMostPairs = 1500;  // of two streams

}  // namespace trueline
