#include "problems/vgd/imu_inputs.h"

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

}  // namespace trueline
