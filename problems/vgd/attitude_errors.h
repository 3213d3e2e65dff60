// The error that an attitude filter makes by itself, as far as the log's gyroscope and
// accelerometer show it.
//
// A filter integrates the gyroscope and pulls its tilt towards the accelerometer's (Li et al. 2019,
// fig. 3). The accelerometer shows the direction of thrust, not of gravity, so the tilt error
// follows the manoeuvres: along the body's axes it is nearly constant in a turn, and looks like an
// accelerometer's bias. The log shows what the filter did: the logged attitude's change, less the
// gyroscope's turn, is the change of its error, but for the gyroscope's bias. Where the gyroscope
// is good enough its turn replaces the filter's feedback over the last `hold` seconds. What stays
// unknown are errors with a known course over time and an unknown size: unknowns with a prior of
// windows, whole flights and diagnoses alike.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/log/flight_log.h"

namespace trueline {

// The logged attitude without the noise that its gyroscope contradicts.
//
// A logged attitude's errors of a few seconds are part of its tilt. Where the tilt is a regressor
// (a share of it is estimated), they would be taken for a share: errors in variables.

// rad in E', level: the turn that takes down to the body's z axis.
Eigen::Vector3d TiltOf(const Eigen::Quaterniond& q_Ep_I);

// The part of an error that changes faster than `memory` s. changes[i] (rad, say) is the error's
// change over seconds[i], before entry i + 1 of the result. It is filtered forwards and backwards,
// so that a constant rate, as of a gyroscope's bias, leaves nothing. No memory: all zero.
std::vector<Eigen::Vector3d> FastPart(const std::vector<Eigen::Vector3d>& changes,
                                      const std::vector<double>& seconds, double memory);

// s over which a gyroscope says more of the tilt than the logged attitude: until its error grows to
// 15 % of the tilt's rms (rad), at most 5 s; 0 for a poor one. `changes` as above: what both
// disagree by.
double MemoryOfGyro(const std::vector<Eigen::Vector3d>& changes, const std::vector<double>& seconds,
                    double tilt_rms);

// `attitude` with changes faster than MemoryOfGyro by the gyroscope. Where `imu` doesn't cover it,
// or has gaps above `max_gap` s, it stays as it is.
std::vector<AttitudeSample> SmoothAttitude(const std::vector<ImuSample>& imu,
                                           const std::vector<AttitudeSample>& attitude,
                                           double max_gap = 0.25);

// The logged attitude's turn against the gyroscope's is taken by such intervals: it is the change
// of the filter's error.
inline constexpr TimeNs kGyroInterval = kNsPerSecond / 10;
inline constexpr double kMostGyroGap = 0.25;  // s, of either stream

// Sums over what both streams cover of an interval, in axes of E' where not stated.
struct GyroInterval {
  double seconds = 0.0;
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();    // rad, of the attitude less the gyroscope's
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();    // s, integral of R_Ep_I
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();    // rad s, integral of the accelerometer's tilt
                                                     // against the filter's
  Eigen::Vector3d pull_I = Eigen::Vector3d::Zero();  // rad s, the same in I
  Eigen::Vector3d tilt = Eigen::Vector3d::Zero();    // rad, of the vehicle, at the end
};

// From the first IMU sample on. `latency`: s, of the attitude.
std::vector<GyroInterval> GyroIntervals(const std::vector<ImuSample>& imu,
                                        const std::vector<AttitudeSample>& attitude,
                                        double latency = 0.0, double max_gap = kMostGyroGap);

// What the turn goes with, three rows an interval: the gyroscope's bias (rad/s, in I), what the
// filter feeds back of the accelerometer's tilt (1/s) and of its integral (1/s^2; Li et al. 2019,
// fig. 3).
inline constexpr int kFeedback = 3;  // the column of the accelerometer's tilt
Eigen::Matrix<double, Eigen::Dynamic, 5> FilterSlopes(const std::vector<GyroInterval>& intervals);

// Sigmas of the priors of what stays unknown; zero: no such error.
struct AttitudeErrorPriors {
  double gyro_bias = 1e-3;  // rad/s, beside what the scatter leaves open; twice that without a hold
  double gain = 0.05;       // 1/s, of the accelerometer's tilt: that of Li et al. 2019, fig. 3
  // Of the vehicle's tilt. Off by default, though measured flights are predicted better with 0.05:
  // where the attitude drifts within a second, part of the drift is taken for a share, and b_ay
  // comes out 0.3 sigma off (simulate/long_flight).
  double share = 0.0;
};

struct AttitudeErrorOptions {
  double longest_hold = 60.0;  // s; 0: the logged attitude is taken as it is
  AttitudeErrorPriors priors;
  bool uses_accelerometer = true;  // false: its tilt has no known relation to the acceleration
  double latency = 0.0;            // s, of the attitude
  double max_gap = kMostGyroGap;   // s
};

// What the log shows of its filter, by least squares over the changes of its tilt.
struct AttitudeFilterFit {
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();  // rad/s, in I
  double k_p = 0.0;                                     // 1/s, gain of the accelerometer's tilt
  double k_i = 0.0;                                     // 1/s^2, gain of its integral
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();  // rad, mean of the accelerometer's tilt, in I
  double scatter = 0.0;  // rad/sqrt(s), root density of what neither bias nor gains explain
};

class AttitudeErrors {
 public:
  // Derivative of Phi_E_Ep (rad) by the errors, in the order of kTheta, in units of their priors'
  // sigmas.
  using Slopes = Eigen::Matrix<double, 3, kFilterSize>;

  // `attitude`: the log's, or that of an own filter on the log's IMU.
  AttitudeErrors(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                 const AttitudeErrorOptions& options);

  // s over which the gyroscope replaces the filter's feedback; 0: it is too poor, or not asked.
  double hold() const { return hold_; }
  const AttitudeFilterFit& fit() const { return fit_; }

  // The logged attitude without the filter's feedback over the last `hold` seconds.
  Eigen::Quaterniond Corrected(TimeNs t, const Eigen::Quaterniond& q_Ep_I) const;
  // The attitude that Corrected() had at t.
  Eigen::Quaterniond Logged(TimeNs t, const Eigen::Quaterniond& corrected) const;
  // Mean over [t0, t1].
  Slopes MeanOver(TimeNs t0, TimeNs t1) const;

 private:
  Eigen::VectorXd CoveredSeconds() const;
  void Fit();
  Eigen::Vector3d ErrorChange(const GyroInterval& interval) const;
  std::vector<Eigen::Vector3d> SmoothTilts() const;
  void Integrate(const AttitudeErrorPriors& priors);
  std::size_t IntervalAt(TimeNs t) const;
  Eigen::Vector3d FeedbackAt(TimeNs t) const;  // rad in E'

  TimeNs begin_ = 0;
  std::vector<GyroInterval> intervals_;
  AttitudeFilterFit fit_;
  double hold_ = 0.0;
  std::vector<Eigen::Vector3f> feedback_;  // rad in E', at the intervals' ends
  std::vector<Eigen::Matrix<float, 3, kFilterSize>> slopes_;
};

}  // namespace trueline
