// The full IMU data, for models that need more than the drive of eq. 15.
#pragma once

#include <algorithm>
#include <vector>

#include "cost_functions/models/kinematic_model.h"
#include "problems/vgd/drive_track.h"

namespace trueline {

// The IMU at the middle of every step of a drive track, with the track's gaps and steps. The
// accelerometer's z axis is the track's thrust, so `thrust: level_flight` applies here as well.
class ImuInputs {
 public:
  // `track` must be made from the same log and outlive this object.
  ImuInputs(const FlightLog& log, const DriveTrack& track);

  // Calls visit(input, dt) for all steps between t0 and t1; the first and the last one are clipped.
  template <typename Visitor>
  void ForEachStep(TimeNs t0, TimeNs t1, Visitor&& visit) const {
    const DriveSteps steps = track_.steps();
    for (std::size_t i = track_.StepAt(t0); i < steps.size() && steps[i].t < t1; ++i) {
      const TimeNs step_end = i + 1 < steps.size() ? steps[i + 1].t : track_.end();
      const TimeNs from = std::max(steps[i].t, t0), to = std::min(step_end, t1);
      if (to > from) visit(inputs_[i], SecondsBetween(from, to));
    }
  }

  // R_Ep_I at t: the step's attitude, rotated by the gyroscope from the step's middle.
  Eigen::Quaterniond AhrsAttitudeAt(TimeNs t) const;
  // The same with the attitude as the log has it (AttitudeErrors).
  Eigen::Quaterniond LoggedAttitudeAt(TimeNs t) const;

  const DriveTrack& track() const { return track_; }

 private:
  Eigen::Quaterniond TurnFromMiddle(std::size_t step, TimeNs t) const;

  const DriveTrack& track_;
  std::vector<ImuInput> inputs_;  // by step of the track
};

// Scatter of a log's gyroscope against its own AHRS. Many logs sample it at a rate that misses half
// of the motion; a data sheet's noise is then too small.

// Root density of the gyroscope's error for each axis of I (rad/s/sqrt(Hz)): the robust scatter of
// (rotation by the AHRS less rotation by the gyroscope) over consecutive quarters of a second, less
// its median, which is bias. Includes the AHRS's corrections in that time. Zero for a log without
// two seconds of gapless flight.
Eigen::Vector3d GyroScatter(const ImuInputs& imu);

}  // namespace trueline
