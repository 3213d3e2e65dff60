// The accelerometer's x and y axes as short means, and how far such means can be trusted.
#pragma once

#include <vector>

#include "problems/log/flight_log.h"
#include "problems/vgd/segment.h"

namespace trueline {

struct ForceSamples {
  std::vector<ForceSample> samples;  // ascending in time, at the middle of their intervals
  double sigma = 0.0;                // m/s^2
};

// Means over consecutive intervals (a hole in the IMU gives none there). Sigma is the larger of
// the option's and the scatter between neighbouring means (robust, from their differences).
ForceSamples AverageForces(const std::vector<ImuSample>& imu, const DragMeasurementOptions& options);

}  // namespace trueline
