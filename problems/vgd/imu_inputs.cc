#include "problems/vgd/imu_inputs.h"

#include <cmath>

#include "problems/result/statistics.h"

namespace trueline {

ImuInputs::ImuInputs(const FlightLog& log, const DriveTrack& track) : track_(track) {
  inputs_.reserve(track.steps().size());
  std::size_t k = 0;
  for (const DriveStep& step : track.steps()) {
    const TimeNs middle = step.t + FromSeconds(0.5 * step.dt);
    while (k + 2 < log.imu.size() && log.imu[k + 1].t <= middle) ++k;
    const ImuSample &before = log.imu[k], &after = log.imu[k + 1];
    const double s = SecondsBetween(before.t, middle) / SecondsBetween(before.t, after.t);
    ImuInput input{before.accel + s * (after.accel - before.accel),
                   before.gyro + s * (after.gyro - before.gyro)};
    input.accel.z() = step.drive.a_z;
    inputs_.push_back(input);
  }
}

Eigen::Quaterniond ImuInputs::TurnFromMiddle(std::size_t step, TimeNs t) const {
  const DriveStep at = track_.steps()[step];
  const double since_middle = SecondsBetween(at.t, t) - 0.5 * at.dt;
  const Eigen::Vector3d half_turn = inputs_[step].gyro * (0.5 * since_middle);
  return RotationFromHalfVector<double>(half_turn);
}

Eigen::Quaterniond ImuInputs::AhrsAttitudeAt(TimeNs t) const {
  const std::size_t i = track_.StepAt(t);
  return Eigen::Quaterniond(track_.steps()[i].drive.R_Ep_I) * TurnFromMiddle(i, t);
}

Eigen::Quaterniond ImuInputs::LoggedAttitudeAt(TimeNs t) const {
  const std::size_t i = track_.StepAt(t);
  const DriveStep step = track_.steps()[i];
  const TimeNs middle = step.t + FromSeconds(0.5 * step.dt);
  const Eigen::Quaterniond corrected(step.drive.R_Ep_I);
  return track_.attitude_errors().Logged(middle, corrected) * TurnFromMiddle(i, t);
}

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
