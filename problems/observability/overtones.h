// Lissajous figures with overtones: each axis repeats a tone and its multiples, and yaw turns
// steadily. Few unknowns with smooth rotor speeds, for designs without derivatives.
#pragma once

#include <Eigen/Core>

#include "problems/trajectory/catalogue.h"

namespace trueline {

inline constexpr int kTones = 3;
// Frequency (Hz), then sine and cosine parts.
inline constexpr Eigen::Index kToneUnknowns = 1 + 2 * kTones;
inline constexpr int kOvertoneUnknowns = kFlatOutputs * kToneUnknowns + 1;

// x, y, z (m), yaw (rad), kToneUnknowns each; then the turn (rad/s).
using Overtones = Eigen::Matrix<double, kOvertoneUnknowns, 1>;

Overtones OvertonesOf(const Lissajous& figure);
// A useful search scale of each unknown, for figures of `size` m and `yaw_size` rad.
Overtones OvertoneUnits(double size, double yaw_size);
// Frequencies are clamped to 0.05 to 1.5 Hz. The amplitude grows from rest at the origin within
// `ramp` seconds and falls as slowly at the end; 0: the figure starts and ends in motion.
PiecewisePolynomial OvertonePath(const Overtones& figure, double duration, double ramp);

}  // namespace trueline
