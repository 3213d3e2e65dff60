// Gaps and saturation of an IMU stream.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/result/statistics.h"

namespace trueline {

// Median time between neighbouring samples, s; 0 for fewer than two samples.
template <class Sample>
double MedianStep(const std::vector<Sample>& samples) {
  if (samples.size() < 2) return 0.0;
  std::vector<double> steps;
  steps.reserve(samples.size() - 1);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps.push_back(SecondsBetween(samples[i - 1].t, samples[i].t));
  }
  return UpperMedian(std::move(steps));
}

// One sentence for steps longer than 5 median steps, and one for each axis that stays at its
// extreme value for 5 samples or more; each names the first place, the number and the total time.
std::vector<std::string> ImuWarnings(const std::vector<ImuSample>& imu);

}  // namespace trueline
