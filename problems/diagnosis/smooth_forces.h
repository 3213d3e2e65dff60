// The accelerometer's x and y, smoothed for a diagnosis.
#pragma once

#include "problems/vgd/force_samples.h"

namespace trueline {

inline constexpr double kForceInterval = 0.125;  // s, between samples

// Every kForceInterval the value at the centre of a parabola through the samples within one
// interval to either side, weighted by a raised cosine. Means would miss the curvature of forces in
// fast turns, which looks like drag. Without the taper, beats between rotor harmonics and the
// window's length remain; they follow thrust as an effect would.
std::vector<ForceSample> SmoothForces(const std::vector<ImuSample>& imu);

}  // namespace trueline
