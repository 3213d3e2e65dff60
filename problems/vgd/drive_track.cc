#include "problems/vgd/drive_track.h"

#include <cmath>

#include "problems/common/error.h"
#include "problems/log/imu_health.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

struct StreamNeeds {
  const FlightLog& log;
  const DriveOptions& options;
  TimeNs latency;
  const AttitudeErrors& errors;
};

double ThrustAt(const StreamNeeds& needs, std::size_t i, double s, const Eigen::Matrix3d& R_Ep_I) {
  if (needs.options.thrust == ThrustSource::kLevelFlight) {
    return LevelFlightThrust(R_Ep_I, needs.log.gravity);
  }
  const double before = needs.log.imu[i].accel.z(), after = needs.log.imu[i + 1].accel.z();
  return before + s * (after - before);
}

// Appends the interval from IMU sample i to i + 1, in `pieces` equal steps. False if the attitude
// is missing.
bool AppendInterval(const StreamNeeds& needs, std::size_t i, int pieces, AttitudeCursor* attitude,
                    std::vector<StoredStep>* steps) {
  const TimeNs t0 = needs.log.imu[i].t, length = needs.log.imu[i + 1].t - t0;
  const std::size_t size_before = steps->size();
  for (int k = 0; k < pieces; ++k) {
    const TimeNs from = t0 + length * k / pieces, to = t0 + length * (k + 1) / pieces;
    const double s = (k + 0.5) / pieces;
    const TimeNs middle = from + (to - from) / 2;
    Eigen::Quaterniond q;
    if (!attitude->At(middle + needs.latency, needs.options.max_gap, &q)) {
      steps->resize(size_before);
      return false;
    }
    q = needs.errors.Corrected(middle, q);
    steps->push_back({from,
                      SecondsBetween(from, to),
                      ThrustAt(needs, i, s, q.toRotationMatrix()),
                      {q.x(), q.y(), q.z(), q.w()}});
  }
  return true;
}

}  // namespace

DriveTrack DriveTrack::FromLog(const FlightLog& log, const DriveOptions& options) {
  if (log.imu.size() < 2) {
    throw ErrorAt(log.directory + "/imu.csv", 0, "needs at least two samples to integrate");
  }
  const bool own_filter =
      options.attitude == AttitudeSource::kComplementaryFilter || log.attitude.empty();
  const std::vector<AttitudeSample> filtered =
      own_filter ? RunComplementaryFilter(log.imu, options.filter) : std::vector<AttitudeSample>();
  const std::vector<AttitudeSample>& samples = own_filter ? filtered : log.attitude;
  const double latency = own_filter ? 0.0 : options.attitude_latency;
  AttitudeCursor attitude(samples);

  DriveTrack track;
  track.attitude_errors_ = std::make_shared<AttitudeErrors>(
      log, samples,
      AttitudeErrorOptions{options.longest_hold, options.attitude_errors,
                           options.thrust != ThrustSource::kLevelFlight, latency, options.max_gap});
  track.gravity_ = log.gravity;
  if (options.thrust != ThrustSource::kAccelerometer) track.axis_ = ThrustAxis::kBody;
  track.log_start_ = log.imu.front().t;
  track.force_effects_ = options.force_effects;
  BindTerms(log, &track.force_effects_);
  track.steps_.reserve(log.imu.size());
  const double median = MedianStep(log.imu);
  const StreamNeeds needs{log, options, FromSeconds(latency), *track.attitude_errors_};
  for (std::size_t i = 0; i + 1 < log.imu.size(); ++i) {
    const TimeNs from = log.imu[i].t, to = log.imu[i + 1].t;
    const double dt = SecondsBetween(from, to);
    const int pieces = std::max(1, static_cast<int>(std::lround(dt / median)));
    const bool usable = dt <= std::max(options.max_gap, 1.5 * median) &&
                        AppendInterval(needs, i, pieces, &attitude, &track.steps_);
    if (usable) {
      track.end_ = to;
    } else if (!track.gaps_.empty() && track.gaps_.back().end == from) {
      track.gaps_.back().end = to;
    } else {
      track.gaps_.push_back({from, to});
    }
  }
  if (track.steps_.empty()) {
    throw ErrorAt(log.directory, 0,
                  fmt::format("imu.csv and attitude.csv do not overlap in time, or attitude.csv is "
                              "slower than one sample in {} s (drive: max_gap_s); check their "
                              "clocks and rates",
                              options.max_gap));
  }
  return track;
}

bool DriveTrack::Covers(TimeNs t0, TimeNs t1) const {
  if (t0 < begin() || t1 > end_) return false;
  return std::none_of(gaps_.begin(), gaps_.end(),
                      [&](const TimeSpan& gap) { return gap.begin < t1 && gap.end > t0; });
}

std::size_t DriveTrack::StepAt(TimeNs t) const {
  const auto after = std::ranges::upper_bound(steps_, t, {}, &StoredStep::t);
  return after == steps_.begin() ? 0 : static_cast<std::size_t>(after - steps_.begin()) - 1;
}

std::vector<AttitudeSample> RunComplementaryFilter(const std::vector<ImuSample>& imu,
                                                   const ComplementaryFilterGains& gains) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < imu.size() && SecondsBetween(imu[0].t, imu[i].t) <= 0.5; ++i) {
    mean += imu[i].accel;
  }
  using Filter = ComplementaryFilter<double>;
  Filter filter(gains, Filter::LevelFrom(mean, 0.0));
  std::vector<AttitudeSample> attitude{{imu[0].t, filter.q_Ep_I()}};
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const Eigen::Vector3d gyro = 0.5 * (imu[i - 1].gyro + imu[i].gyro);
    const Eigen::Vector3d accel = 0.5 * (imu[i - 1].accel + imu[i].accel);
    filter.Step(gyro, accel, SecondsBetween(imu[i - 1].t, imu[i].t));
    attitude.push_back({imu[i].t, filter.q_Ep_I()});
  }
  return attitude;
}

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
