// The model's input over a whole log: attitude and thrust-axis acceleration for each IMU step.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "cost_functions/models/complementary_filter.h"
#include "cost_functions/models/force_effects.h"
#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/kinematic_model.h"
#include "problems/log/flight_log.h"
#include "problems/vgd/attitude_errors.h"

namespace trueline {

// The thrust-axis acceleration is the accelerometer's z axis; the same, taken for the axis of the
// body as the paper does; or that of level flight.
enum class ThrustSource { kAccelerometer, kAsPublished, kLevelFlight };
// Their names in configurations and flags.
inline constexpr std::initializer_list<std::pair<const char*, ThrustSource>> kThrustSources = {
    {"accelerometer", ThrustSource::kAccelerometer},
    {"level_flight", ThrustSource::kLevelFlight},
    {"as_published", ThrustSource::kAsPublished}};
enum class AttitudeSource { kLogged, kComplementaryFilter };

struct DriveOptions {
  ThrustSource thrust = ThrustSource::kAccelerometer;
  AttitudeSource attitude = AttitudeSource::kLogged;  // the filter runs where no attitude is logged
  ComplementaryFilterGains filter;
  double attitude_latency = 0.0;  // s; the attitude stamped t was that of t - latency
  // The gyroscope carries the attitude until its drift exceeds the filter's error, at most this
  // long (s). 0: the attitude as logged.
  double longest_hold = 60.0;
  AttitudeErrorPriors attitude_errors;
  // Gaps up to this length (s) are interpolated; longer ones are never integrated through.
  double max_gap = 0.25;
  ForceEffects force_effects;  // of an extended model (trueline-diagnose); none by default
};

// One step of the log: `dt` seconds from t, with the drive at its middle.
struct DriveStep {
  TimeNs t;
  double dt;
  Drive drive;
};

// A step as a track stores it: a quaternion instead of a matrix, because an hour has millions.
struct StoredStep {
  TimeNs t;
  double dt;
  double a_z;
  double q_Ep_I[4];  // x y z w

  DriveStep Step() const { return {t, dt, {Eigen::Quaterniond(q_Ep_I).toRotationMatrix(), a_z}}; }
};

// The steps of a track, to be read by index or in a loop.
class DriveSteps {
 public:
  class Iterator {
   public:
    explicit Iterator(const StoredStep* at) : at_(at) {}
    DriveStep operator*() const { return at_->Step(); }
    Iterator& operator++() { return ++at_, *this; }
    bool operator!=(const Iterator& other) const { return at_ != other.at_; }

   private:
    const StoredStep* at_;
  };

  explicit DriveSteps(std::span<const StoredStep> steps) : steps_(steps) {}
  DriveStep operator[](std::size_t i) const { return steps_[i].Step(); }
  DriveStep front() const { return steps_.front().Step(); }
  DriveStep back() const { return steps_.back().Step(); }
  std::size_t size() const { return steps_.size(); }
  Iterator begin() const { return Iterator(steps_.data()); }
  Iterator end() const { return Iterator(steps_.data() + steps_.size()); }

 private:
  std::span<const StoredStep> steps_;
};

struct TimeSpan {
  TimeNs begin;
  TimeNs end;
};

class DriveTrack {
 public:
  // Throws InputError if the streams do not overlap. Gaps below max_gap are divided into steps of
  // the stream's median length, which keeps the integration accurate across lost samples.
  static DriveTrack FromLog(const FlightLog& log, const DriveOptions& options);

  TimeNs begin() const { return steps_.front().t; }
  TimeNs end() const { return end_; }
  TimeNs log_start() const { return log_start_; }  // first IMU sample: the origin of effects' times
  double gravity() const { return gravity_; }
  ThrustAxis thrust_axis() const { return axis_; }
  const ForceEffects& force_effects() const { return force_effects_; }
  const AttitudeErrors& attitude_errors() const { return *attitude_errors_; }
  DriveSteps steps() const { return DriveSteps(steps_); }
  const std::vector<TimeSpan>& gaps() const { return gaps_; }

  // False if [t0, t1] leaves the track or overlaps a gap.
  bool Covers(TimeNs t0, TimeNs t1) const;

  // Index of the step that contains t; t must be covered.
  std::size_t StepAt(TimeNs t) const;

  // Calls visit(drive, dt) for all steps between t0 and t1; the first and the last one are clipped.
  template <typename Visitor>
  void ForEachStep(TimeNs t0, TimeNs t1, Visitor&& visit) const {
    ForEachIndex(t0, t1, [&](std::size_t i, double dt) { visit(steps_[i].Step().drive, dt); });
  }
  // The same with the step's index.
  template <typename Visitor>
  void ForEachIndex(TimeNs t0, TimeNs t1, Visitor&& visit) const {
    for (std::size_t i = StepAt(t0); i < steps_.size() && steps_[i].t < t1; ++i) {
      const TimeNs step_end = i + 1 < steps_.size() ? steps_[i + 1].t : end_;
      const TimeNs from = std::max(steps_[i].t, t0), to = std::min(step_end, t1);
      if (to > from) visit(i, SecondsBetween(from, to));
    }
  }

 private:
  std::vector<StoredStep> steps_;
  std::vector<TimeSpan> gaps_;
  TimeNs end_ = 0;
  TimeNs log_start_ = 0;
  double gravity_ = 9.81;
  ThrustAxis axis_ = ThrustAxis::kImu;
  ForceEffects force_effects_;
  std::shared_ptr<const AttitudeErrors> attitude_errors_;
};

// Attitude at every IMU sample by the project's own complementary filter, for logs without one. It
// levels on the first half second of the accelerometer and starts at heading zero.
std::vector<AttitudeSample> RunComplementaryFilter(const std::vector<ImuSample>& imu,
                                                   const ComplementaryFilterGains& gains);

// The full IMU data, for models that need more than the drive of eq. 15: the IMU at the middle of
// every step of a drive track, with the track's gaps and steps. The accelerometer's z axis is the
// track's thrust, so `thrust: level_flight` applies here as well.
class ImuInputs {
 public:
  // `track` must be made from the same log and outlive this object.
  ImuInputs(const FlightLog& log, const DriveTrack& track);

  // Calls visit(input, dt) for all steps between t0 and t1; the first and the last one are clipped.
  template <typename Visitor>
  void ForEachStep(TimeNs t0, TimeNs t1, Visitor&& visit) const {
    track_.ForEachIndex(t0, t1, [&](std::size_t i, double dt) { visit(inputs_[i], dt); });
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
//
// Root density of the gyroscope's error for each axis of I (rad/s/sqrt(Hz)): the robust scatter of
// (rotation by the AHRS less rotation by the gyroscope) over consecutive quarters of a second, less
// its median, which is bias. Includes the AHRS's corrections in that time. Zero for a log without
// two seconds of gapless flight.
Eigen::Vector3d GyroScatter(const ImuInputs& imu);

}  // namespace trueline
