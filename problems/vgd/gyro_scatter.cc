#include "problems/vgd/gyro_scatter.h"

#include <cmath>

#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kInterval = 0.25;  // s
constexpr std::size_t kEnough = 8;  // intervals

// Rotation vector in I (rad, small) of the AHRS's rotation less the gyroscope's.
Eigen::Vector3d Disagreement(const ImuInputs& imu, TimeNs t0, TimeNs t1) {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  imu.ForEachStep(t0, t1, [&](const ImuInput& input, double dt) {
    const Eigen::Vector3d half = input.gyro * (0.5 * dt);
    turn = turn * RotationFromHalfVector<double>(half);
  });
  const Eigen::Quaterniond by_ahrs =
      imu.LoggedAttitudeAt(t0).conjugate() * imu.LoggedAttitudeAt(t1);
  const Eigen::Quaterniond rest = turn.conjugate() * by_ahrs;
  return std::copysign(2.0, rest.w()) * rest.vec();
}

}  // namespace

Eigen::Vector3d GyroScatter(const ImuInputs& imu) {
  const DriveTrack& track = imu.track();
  const TimeNs interval = FromSeconds(kInterval);
  std::vector<double> turns[3];
  for (TimeNs t = track.begin(); t + interval < track.end(); t += interval) {
    if (!track.Covers(t, t + interval)) continue;
    const Eigen::Vector3d turn = Disagreement(imu, t, t + interval);
    for (int axis = 0; axis < 3; ++axis) turns[axis].push_back(turn[axis]);
  }
  if (turns[0].size() < kEnough) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d sigma(SigmaByMedian(turns[0]), SigmaByMedian(turns[1]),
                              SigmaByMedian(turns[2]));
  return sigma / std::sqrt(kInterval);
}

}  // namespace trueline
