#include "problems/vgd/force_samples.h"

#include <Eigen/Dense>
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

namespace {

// A parabola through weighted values around u = 0, by its normal equations.
class LocalParabola {
 public:
  void Add(double u, double weight, const Eigen::Vector2d& value) {
    const Eigen::Vector3d powers(1.0, u, u * u);
    gram_ += weight * powers * powers.transpose();
    products_ += weight * powers * value.transpose();
    ++count_;
  }
  int count() const { return count_; }
  Eigen::Vector2d AtZero() const { return gram_.ldlt().solve(products_).row(0); }

 private:
  Eigen::Matrix3d gram_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> products_ = Eigen::Matrix<double, 3, 2>::Zero();
  int count_ = 0;
};

}  // namespace

std::vector<ForceSample> SmoothForces(const std::vector<ImuSample>& imu) {
  constexpr int kFewestSamples = 4;  // samples for a parabola
  std::vector<ForceSample> samples;
  const double span = SecondsBetween(imu.front().t, imu.back().t);
  std::size_t first = 0;
  for (int k = 1; (k + 1) * kForceInterval < span; ++k) {
    const TimeNs middle = imu.front().t + FromSeconds(k * kForceInterval);
    while (SecondsBetween(imu[first].t, middle) >= kForceInterval) ++first;
    LocalParabola parabola;
    for (std::size_t i = first; i < imu.size(); ++i) {
      const double u = SecondsBetween(middle, imu[i].t) / kForceInterval;
      if (u >= 1.0) break;
      parabola.Add(u, 1.0 + std::cos(M_PI * u), imu[i].accel.head<2>());
    }
    if (parabola.count() >= kFewestSamples) samples.push_back({middle, parabola.AtZero()});
  }
  return samples;
}

}  // namespace trueline
