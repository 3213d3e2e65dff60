// The accelerometer's x and y as a diagnosis uses them.
#pragma once

#include "problems/window/force_samples.h"

namespace trueline {

inline constexpr double kForceInterval = 0.125;  // s, between samples

// Weighted means (a raised cosine, two intervals wide) every kForceInterval. Plain means let beats
// between rotor harmonics and their length through, and those follow thrust as an effect would.
std::vector<ForceSample> SmoothForces(const std::vector<ImuSample>& imu);

}  // namespace trueline
