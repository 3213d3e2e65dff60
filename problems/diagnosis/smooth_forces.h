// The accelerometer's x and y as a diagnosis uses them.
#pragma once

#include "problems/window/force_samples.h"

namespace trueline {

inline constexpr double kForceInterval = 0.125;  // s, between samples

// Every kForceInterval the middle of a parabola through the samples within an interval to either
// side, weighted by a raised cosine. Means would miss the curvature of forces in fast turns, which
// looks like drag; without the taper, beats between rotor harmonics and the window's length pass,
// which follow thrust as an effect would.
std::vector<ForceSample> SmoothForces(const std::vector<ImuSample>& imu);

}  // namespace trueline
