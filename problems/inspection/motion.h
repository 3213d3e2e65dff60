// The motion that the streams of a log show, in a form that two streams can be compared in.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/inspection/vector_match.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Integral of a sampled signal over time, for means over any span without resampling the samples.

// On a grid of `step` seconds; linear between. Signals of N numbers.
template <int N>
class RunningIntegral {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;

  RunningIntegral() = default;

  // Samples are joined by straight lines; a step above `max_gap` (s) is a gap, over which nothing
  // is known.
  RunningIntegral(double step, double max_gap) : step_(step), max_gap_(max_gap) {}

  // Appends a sample; `t` (s) increases. Samples are not kept, because an hour has millions.
  void Add(double t, const Vector& value) {
    if (samples_ == 0) begin_ = t;
    if (samples_ > 0) IntegrateTo(t, value);
    ++samples_;
    last_t_ = t;
    last_ = value;
  }

  // The integral of the integral.
  RunningIntegral Integrated() && {
    Vector before = Vector::Zero(), sum = Vector::Zero();
    for (std::size_t k = 0; k < integral_.size(); ++k) {
      if (k > 0) sum += 0.5 * step_ * (before + integral_[k]);
      before = integral_[k];
      integral_[k] = sum;
    }
    return std::move(*this);
  }

  // Whether [from, to] lies inside the samples and holds no gap.
  bool Knows(double from, double to) const {
    if (integral_.size() < 2 || from < begin_ || to >= Time(integral_.size() - 1)) return false;
    return gaps_[Index(from)] == gaps_[Index(to) + 1];
  }
  // For known times only.
  Vector At(double t) const {
    const std::size_t k = Index(t);
    const double share = (t - Time(k)) / step_;
    return (1.0 - share) * integral_[k] + share * integral_[k + 1];
  }
  Vector Mean(double from, double to) const { return (At(to) - At(from)) / (to - from); }

 private:
  double Time(std::size_t k) const { return begin_ + static_cast<double>(k) * step_; }
  std::size_t Index(double t) const {
    return std::min(static_cast<std::size_t>((t - begin_) / step_), integral_.size() - 2);
  }

  void IntegrateTo(double t, const Vector& value) {
    const double span = t - last_t_;
    const Vector slope = (value - last_) / span;
    if (span > max_gap_) ++gap_count_;
    for (double grid = Time(integral_.size()); grid <= t; grid = Time(integral_.size())) {
      const double dt = grid - last_t_;
      integral_.push_back(until_last_ + dt * last_ + 0.5 * dt * dt * slope);
      gaps_.push_back(gap_count_);
    }
    until_last_ += 0.5 * span * (last_ + value);
  }

  double begin_ = 0.0;
  double step_ = 1.0;
  double max_gap_ = 0.0;
  std::vector<Vector> integral_;  // at the points of the grid
  std::vector<int> gaps_;         // before each
  std::size_t samples_ = 0;
  double last_t_ = 0.0;
  Vector last_ = Vector::Zero();
  Vector until_last_ = Vector::Zero();  // integral up to the last sample
  int gap_count_ = 0;
};

// Seconds since the first IMU sample.
class LogClock {
 public:
  explicit LogClock(const FlightLog& log) : begin_(log.imu.front().t) {}
  double operator()(TimeNs t) const { return SecondsBetween(begin_, t); }

 private:
  TimeNs begin_;
};

// s, of the grid that integrals are kept on; wider on a long log, so that memory has a bound.
double GridStep(const FlightLog& log);

std::vector<AttitudeSample> AttitudesOf(const std::vector<PoseSample>& poses);

// Whether `other` is the log's attitude over again: at its stamps or between them, or its numbers
// at other stamps or in another form.
bool RepeatsAttitude(const FlightLog& log, const std::vector<AttitudeSample>& other);

// Position over time, of fixes or poses.
struct PositionSample {
  TimeNs t;
  Eigen::Vector3d p_E;  // m
};
template <class Sample>
std::vector<PositionSample> PositionsOf(const std::vector<Sample>& samples) {
  std::vector<PositionSample> positions;
  for (const Sample& sample : samples) positions.push_back({sample.t, sample.p_E});
  return positions;
}
// Of mocap, pose or fixes.
std::vector<PositionSample> PositionsOf(const FlightLog& log, const std::string& stream);

RunningIntegral<3> GyroIntegral(const FlightLog& log);

// Turn of an attitude between two samples over the time between.
struct AttitudeTurn {
  double from, to;          // s
  Eigen::Vector3d of_body;  // rad/s, in axes of the body
  Eigen::Vector3d of_earth;
  Eigen::Quaterniond first, last;
};

inline constexpr double kTurnBaseline = 0.1;  // s

// Turns over `baseline` (s), or over the stream's steps where these are longer (up to 0.5 s), at
// most `most` of them.
std::vector<AttitudeTurn> TurnsOf(const std::vector<AttitudeSample>& attitude,
                                  const LogClock& clock, std::size_t most,
                                  double baseline = kTurnBaseline);

// Rates of the attitude against those of the gyroscope. `of_earth`: the attitude's rates in earth
// axes, as they come out where its quaternions are inverted.
PairsAt RatePairs(const RunningIntegral<3>& gyro, const std::vector<AttitudeTurn>& turns,
                  bool of_earth);

// Second differences of position: acceleration weighted by a triangle of half width `half`.
struct Bend {
  double t;                      // s, of the middle
  double half;                   // s
  Eigen::Vector3d acceleration;  // m/s^2
};
// `half` (s) at least; wider where the steps of the stream ask for that, up to three times.
std::vector<Bend> BendsOf(const std::vector<PositionSample>& positions, const LogClock& clock,
                          double half, std::size_t most);

// Specific force turned to the earth of the attitude, twice integrated.
RunningIntegral<3> ForceIntegral(const FlightLog& log, const std::vector<AttitudeSample>& attitude);
// Mean of that (m/s^2) under triangles of half width `half` (s) about the attitude's samples: minus
// gravity, whatever a vehicle does that ends as fast as it starts. None where too few are known.
std::optional<Eigen::Vector3d> MeanForceInEarth(const FlightLog& log,
                                                const std::vector<AttitudeSample>& attitude,
                                                double half);
// The same for each axis of the body: element 3 k + l is column k of the rotation times force l.
RunningIntegral<9> AxisForceIntegral(const FlightLog& log,
                                     const std::vector<AttitudeSample>& attitude, int earth_axis);
// The same of a reading of 1: element k is column k of the rotation.
RunningIntegral<3> AxisIntegral(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                                int earth_axis);

// Mean force under a triangle centred at bend.t - lag.
template <int N>
Eigen::Matrix<double, N, 1> UnderTriangle(const RunningIntegral<N>& twice, const Bend& bend,
                                          double lag) {
  const double t = bend.t - lag, h = bend.half;
  return (twice.At(t + h) - 2.0 * twice.At(t) + twice.At(t - h)) / (h * h);
}

PairsAt AccelerationPairs(const RunningIntegral<3>& force, const std::vector<Bend>& bends);

// At most 1,500 fixes, each beside mocap's position at the same time less the lag; fixes where
// mocap has a gap are left out. `log` must outlive what is returned.
PairsAt FixPairs(const FlightLog& log);

}  // namespace trueline
