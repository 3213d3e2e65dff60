// What a flight controller does to the streams before it logs them: filters and delays. Real logs
// have both; the vehicle itself flies on the raw readings.
#pragma once

#include <vector>

#include "problems/log/flight_log.h"

namespace trueline::simulation {

// Passes the gyroscope through a causal Butterworth low-pass of second order (bilinear transform,
// Oppenheim & Schafer, Discrete-Time Signal Processing, sec. 7.1). `cutoff` in Hz, above 0 and
// below half the rate of `imu`. Slow motion comes late by 0.225 / cutoff.
void LowPassGyro(double cutoff, std::vector<ImuSample>* imu);

// Stamps the samples this much (s) after they were taken.
void StampLater(double delay, std::vector<ChannelsSample>* samples);

}  // namespace trueline::simulation
