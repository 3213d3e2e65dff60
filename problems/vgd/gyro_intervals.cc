#include "problems/vgd/gyro_intervals.h"

#include "cost_functions/models/complementary_filter.h"
#include "cost_functions/models/rotation.h"
#include "problems/log/attitude_cursor.h"
#include "problems/vgd/smooth_attitude.h"

namespace trueline {

using Eigen::Quaterniond;
using Eigen::Vector3d;

std::vector<GyroInterval> GyroIntervals(const std::vector<ImuSample>& imu,
                                        const std::vector<AttitudeSample>& attitude, double latency,
                                        double max_gap) {
  if (imu.size() < 2 || attitude.size() < 2) return {};
  const TimeNs begin = imu.front().t, late = FromSeconds(latency);
  const auto count = static_cast<std::size_t>((imu.back().t - begin) / kGyroInterval) + 1;
  std::vector<GyroInterval> intervals(count);
  AttitudeCursor cursor(attitude);
  Quaterniond q_begin, turn = Quaterniond::Identity();
  bool known = cursor.At(begin + late, max_gap, &q_begin);
  std::size_t current = 0;
  for (std::size_t i = 0; i + 1 < imu.size(); ++i) {
    const ImuSample &before = imu[i], &after = imu[i + 1];
    const double dt = SecondsBetween(before.t, after.t);
    GyroInterval& interval = intervals[current];
    Quaterniond q_next;
    const bool next_known = dt <= max_gap && cursor.At(after.t + late, max_gap, &q_next);
    if (known && next_known) {
      turn = turn * RotationByVector(0.5 * dt * (before.gyro + after.gyro));
      const Vector3d pull =
          ComplementaryFilter<double>::TiltError(0.5 * (before.accel + after.accel), q_next);
      interval.seconds += dt;
      interval.axes += dt * q_next.toRotationMatrix();
      interval.pull += dt * (q_next * pull);
      interval.pull_I += dt * pull;
    }
    const auto at = static_cast<std::size_t>((after.t - begin) / kGyroInterval);
    if (at != current || i + 2 == imu.size() || !next_known || !known) {
      if (known && next_known) {
        interval.turn += RotationVector(q_next * (q_begin * turn).conjugate());
        interval.tilt = TiltOf(q_next);
      }
      turn.setIdentity();
      q_begin = q_next;
      current = at;
    }
    known = next_known;
  }
  return intervals;
}

Eigen::Matrix<double, Eigen::Dynamic, 5> FilterSlopes(const std::vector<GyroInterval>& intervals) {
  Eigen::Matrix<double, Eigen::Dynamic, 5> slopes(3 * intervals.size(), 5);
  Vector3d wound_up = Vector3d::Zero();  // rad s, in I
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    const GyroInterval& interval = intervals[k];
    wound_up += interval.pull_I;
    slopes.middleRows<3>(static_cast<Eigen::Index>(3 * k)) << -interval.axes, interval.pull,
        interval.axes * wound_up;
  }
  return slopes;
}

}  // namespace trueline
