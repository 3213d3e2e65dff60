// Gaps and saturation of an IMU stream.
#pragma once

#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// Median time between neighbouring samples, s; 0 for fewer than two samples.
double MedianStep(const std::vector<ImuSample>& imu);

// One sentence for steps longer than 5 median steps, and one for each axis that stays at its
// extreme value for 5 samples or more; each names the first place, the number and the total time.
std::vector<std::string> ImuWarnings(const std::vector<ImuSample>& imu);

}  // namespace trueline
