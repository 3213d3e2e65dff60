// Gaps and saturation of an IMU stream.
#pragma once

#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// Seconds between neighbouring samples, the middle one of all; 0 for fewer than two samples.
double MedianStep(const std::vector<ImuSample>& imu);

// One sentence for the steps longer than 5 median steps, and one for each axis that sits on its
// extreme value for 5 samples or more; each names the first place, how often and how long.
std::vector<std::string> ImuWarnings(const std::vector<ImuSample>& imu);

}  // namespace trueline
