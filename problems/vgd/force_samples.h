// Short means of the accelerometer's x and y axes and their sigma, or smoothed values.
#pragma once

#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// Use of the accelerometer's x and y axes, which the paper's fit does not use.
struct DragMeasurementOptions {
  bool enabled = true;
  double interval = 0.1;  // s, over which the accelerometer is averaged
  // m/s^2, of such a mean, for forces other than drag. The larger of this and the scatter of
  // neighbouring means is used, so that a vibrating or poor accelerometer gets less weight.
  double sigma = 0.14;
  double bias_sigma = 1.0;  // m/s^2, prior of b_ax and b_ay
  double scale = 1.0;       // of the sigma, as whole flights learn it
};

// The accelerometer's x and y, averaged over a short interval around t.
struct ForceSample {
  TimeNs t;
  Eigen::Vector2d accel_xy;  // m/s^2
};

struct ForceSamples {
  std::vector<ForceSample> samples;  // ascending in time, at the middle of their intervals
  double sigma = 0.0;                // m/s^2
};

// Means over consecutive intervals; none in a gap of the IMU. Sigma is the larger of the option's
// and the robust scatter of neighbouring means.
ForceSamples AverageForces(const std::vector<ImuSample>& imu,
                           const DragMeasurementOptions& options);

inline constexpr double kForceInterval = 0.125;  // s, between smoothed samples

// For a diagnosis: every kForceInterval the value at the centre of a parabola through the samples
// within one interval to either side, weighted by a raised cosine. Means would miss the curvature
// of forces in fast turns, which looks like drag. Without the taper, beats between rotor harmonics
// and the window's length remain; they follow thrust as an effect would.
std::vector<ForceSample> SmoothForces(const std::vector<ImuSample>& imu);

}  // namespace trueline
