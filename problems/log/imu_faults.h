// Gaps and saturation of an IMU stream, one by one; imu_health.h has them as sentences.
#pragma once

#include <array>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

inline constexpr double kLeastImuRate = 20.0;  // Hz; below, no manoeuvre can be integrated
inline constexpr double kUsualImuRate = 90.0;  // Hz; below, fast manoeuvres are integrated poorly

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

}  // namespace trueline
