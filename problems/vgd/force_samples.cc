#include "problems/vgd/force_samples.h"

#include <algorithm>
#include <cmath>

#include "problems/result/statistics.h"

namespace trueline {
namespace {

// Standard deviation of one mean, from the median absolute difference of neighbours: robust to
// outliers, insensitive to slow manoeuvres.
double ScatterOf(const std::vector<ForceSample>& samples) {
  std::vector<double> differences;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const Eigen::Vector2d d = samples[i].accel_xy - samples[i - 1].accel_xy;
    differences.insert(differences.end(), {std::abs(d.x()), std::abs(d.y())});
  }
  return SigmaOfSizes(std::move(differences)) / std::sqrt(2.0);
}

}  // namespace

ForceSamples AverageForces(const std::vector<ImuSample>& imu,
                           const DragMeasurementOptions& options) {
  ForceSamples forces;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const double span = SecondsBetween(imu[begin].t, imu[i].t);
    if (span < options.interval) continue;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (std::size_t k = begin; k < i; ++k) sum += imu[k].accel.head<2>();
    // A gap makes the interval longer than asked for; its mean would have the wrong time.
    if (span < 2.0 * options.interval || i == begin + 1) {
      const TimeNs middle = (imu[begin].t + imu[i - 1].t) / 2;
      forces.samples.push_back({middle, sum / static_cast<double>(i - begin)});
    }
    begin = i;
  }
  forces.sigma = std::max(options.sigma, ScatterOf(forces.samples));
  return forces;
}

}  // namespace trueline
