// Figures with overtones: Lissajous figures whose axes each repeat a tone and its multiples, and a
// steady turn. Few unknowns with smooth rotor speeds, for designs that have no derivatives.
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
// By how much each unknown may usefully differ, for figures of `size` m and `yaw_size` rad.
Overtones OvertoneUnits(double size, double yaw_size);
// Frequencies outside of 0.05 to 1.5 Hz are taken at those bounds. The figure swells from rest at
// the origin within `ramp` seconds and dies away as slowly at the end; 0: it starts and ends in
// motion.
PiecewisePolynomial OvertonePath(const Overtones& figure, double duration, double ramp);

}  // namespace trueline
