// Gaps and saturation of an IMU stream, one by one and as sentences.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/result/statistics.h"

namespace trueline {

inline constexpr double kLeastImuRate = 20.0;   // Hz; below, no manoeuvre can be integrated
inline constexpr double kFastestImuRate = 1e5;  // Hz; above, the stamps are in another unit
inline constexpr double kUsualImuRate = 90.0;   // Hz; below, fast manoeuvres are integrated poorly

// Stretches of time that share a fault.
struct Episodes {
  int count = 0;
  double first = 0.0;     // s, start of the first one
  double duration = 0.0;  // s, all together
  double longest = 0.0;   // s

  void Add(TimeNs from, TimeNs to);
};

struct Saturation {
  const char* axis;
  double at;  // the extreme value, in the axis's unit
  Episodes episodes;
};

inline constexpr std::array<const char*, 6> kImuAxes = {"ax", "ay", "az", "gx", "gy", "gz"};
double AxisValue(const ImuSample& sample, std::size_t axis);  // in the order of kImuAxes

// Axes that stay at their extreme value for 5 samples or more, but not for most of the log: that is
// a sensor that is stuck. Values near the extreme must not stay likewise: that is a smooth signal
// in coarse steps.
std::vector<Saturation> ImuSaturations(const std::vector<ImuSample>& imu);

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

// Samples a second, over all of them; 0 for fewer than two.
template <class Sample>
double MeanRate(const std::vector<Sample>& samples) {
  const double span = samples.empty() ? 0.0 : SecondsBetween(samples.front().t, samples.back().t);
  return span > 0.0 ? static_cast<double>(samples.size() - 1) / span : 0.0;
}

// One sentence for steps longer than 5 median steps, and one for each axis that stays at its
// extreme value for 5 samples or more; each names the first place, the number and the total time.
std::vector<std::string> ImuWarnings(const std::vector<ImuSample>& imu);

}  // namespace trueline
