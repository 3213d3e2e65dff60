// The smoothed accelerometer x and y of a diagnosis: effects of turns are kept, vibration of rotors
// is removed.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "problems/vgd/force_samples.h"

namespace trueline {
namespace {

std::vector<ImuSample> Imu(double rate, double seconds, const std::function<double(double)>& a_x) {
  std::vector<ImuSample> imu;
  imu.reserve(static_cast<std::size_t>(rate * seconds));
  for (int i = 0; i < rate * seconds; ++i) {
    imu.push_back({FromSeconds(i / rate), Eigen::Vector3d(a_x(i / rate), 0.0, -9.8),
                   Eigen::Vector3d::Zero()});
  }
  return imu;
}

double LargestError(const std::vector<ImuSample>& imu, const std::function<double(double)>& truth) {
  double largest = 0.0;
  for (const ForceSample& sample : SmoothForces(imu)) {
    largest = std::max(largest, std::abs(sample.accel_xy.x() - truth(ToSeconds(sample.t))));
  }
  return largest;
}

// Drag in a turn of 3 rad/s; a plain mean over the same span misses its curvature by 2 %.
TEST(SmoothForces, KeepTheCurvatureOfTurns) {
  const auto turn = [](double t) { return 5.0 * std::sin(3.0 * t); };
  EXPECT_LT(LargestError(Imu(512, 10, turn), turn), 0.005);
  EXPECT_LT(LargestError(Imu(60, 10, turn), turn), 0.005);
}

TEST(SmoothForces, LeaveVibrationOut) {
  for (const double hz : {60.0, 97.0, 180.0}) {
    const auto vibration = [hz](double t) { return std::sin(2.0 * M_PI * hz * t); };
    EXPECT_LT(LargestError(Imu(512, 10, vibration), [](double) { return 0.0; }), 0.01) << hz;
  }
}

TEST(SmoothForces, NeedEnoughSamplesForAParabola) {
  EXPECT_TRUE(SmoothForces(Imu(8, 10, [](double) { return 1.0; })).empty());
}

}  // namespace
}  // namespace trueline
