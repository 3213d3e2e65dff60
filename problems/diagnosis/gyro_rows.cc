#include "problems/diagnosis/gyro_rows.h"

#include "cost_functions/models/complementary_filter.h"
#include "cost_functions/models/rotation.h"
#include "problems/log/attitude_cursor.h"

namespace trueline {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

StreamRows GyroRows(const FlightLog& log) {
  constexpr TimeNs kLength = kNsPerSecond / 10;
  constexpr double kLongestGap = 0.25;  // s, of either stream
  constexpr Eigen::Index kOffsets = 5;
  StreamRows rows;
  if (log.imu.size() < 2 || log.attitude.size() < 2) return rows;
  const TimeNs begin = log.imu.front().t;
  const auto count = static_cast<Eigen::Index>((log.imu.back().t - begin) / kLength);
  rows.r = Eigen::VectorXd::Zero(3 * count);
  rows.nuisances = Eigen::MatrixXd::Zero(3 * count, kOffsets);
  AttitudeCursor cursor(log.attitude);
  Quaterniond q_begin, turn = Quaterniond::Identity();
  Matrix3d axes = Matrix3d::Zero();                      // s, integral of R_Ep_I
  Vector3d pull = Vector3d::Zero(), wound_up = pull;     // rad s, in E' and in I
  bool known = cursor.At(begin, kLongestGap, &q_begin);  // the attitude at the interval's begin
  std::size_t i = 0;
  for (Eigen::Index k = 0; k < count; ++k) {
    rows.t.push_back(ToSeconds((k + 1) * kLength));
    Quaterniond q = q_begin;
    bool next_known = known;
    for (; i + 1 < log.imu.size() && log.imu[i + 1].t <= begin + (k + 1) * kLength; ++i) {
      const ImuSample &before = log.imu[i], &after = log.imu[i + 1];
      const double dt = SecondsBetween(before.t, after.t);
      next_known = dt <= kLongestGap && cursor.At(after.t, kLongestGap, &q);
      known = known && next_known;
      if (!next_known) continue;
      turn = turn * RotationByVector(0.5 * dt * (before.gyro + after.gyro));
      const Vector3d tilt_I =
          ComplementaryFilter<double>::TiltError(0.5 * (before.accel + after.accel), q);
      axes += dt * q.toRotationMatrix();
      pull += dt * (q * tilt_I);
      wound_up += dt * tilt_I;
    }
    if (known) {
      rows.r.segment<3>(3 * k) = RotationVector(q * (q_begin * turn).conjugate());
      rows.nuisances.middleRows<3>(3 * k) << -axes, pull, axes * wound_up;
    }
    known = next_known;
    q_begin = q;
    turn.setIdentity(), axes.setZero(), pull.setZero();
  }
  return rows;
}

}  // namespace trueline
