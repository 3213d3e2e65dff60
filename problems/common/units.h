// Units of files and flags in those of the program (SI).
#pragma once

#include <cmath>

namespace trueline {

inline constexpr double kDegree = M_PI / 180.0;  // rad
inline constexpr double kRpm = M_PI / 30.0;      // rad/s

}  // namespace trueline
