#include "problems/diagnosis/smooth_forces.h"

#include <cmath>

namespace trueline {

std::vector<ForceSample> SmoothForces(const std::vector<ImuSample>& imu) {
  std::vector<ForceSample> samples;
  const double span = SecondsBetween(imu.front().t, imu.back().t);
  std::size_t first = 0;
  for (int k = 1; (k + 1) * kForceInterval < span; ++k) {
    const TimeNs middle = imu.front().t + FromSeconds(k * kForceInterval);
    while (SecondsBetween(imu[first].t, middle) >= kForceInterval) ++first;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weights = 0.0;
    int count = 0;
    for (std::size_t i = first; i < imu.size(); ++i, ++count) {
      const double u = SecondsBetween(middle, imu[i].t) / kForceInterval;
      if (u >= 1.0) break;
      const double weight = 1.0 + std::cos(M_PI * u);
      sum += weight * imu[i].accel.head<2>();
      weights += weight;
    }
    if (count >= 2) samples.push_back({middle, sum / weights});
  }
  return samples;
}

}  // namespace trueline
