#include "problems/diagnosis/smooth_forces.h"

#include <Eigen/Dense>
#include <cmath>

namespace trueline {
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
