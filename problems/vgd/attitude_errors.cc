#include "problems/vgd/attitude_errors.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "cost_functions/models/complementary_filter.h"
#include "cost_functions/models/rotation.h"
#include "problems/common/units.h"
#include "problems/log/samples.h"

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// The gyroscope's integral, for times that ascend. Samples are joined by straight lines.
class GyroCursor {
 public:
  GyroCursor(const std::vector<ImuSample>& imu, double max_gap) : imu_(imu), max_gap_(max_gap) {}

  // rad in I; none outside of the stream or in a gap.
  std::optional<Vector3d> At(TimeNs t) {
    while (i_ + 1 < imu_.size() && imu_[i_ + 1].t <= t) {
      sum_ += Over(imu_[i_ + 1].t);
      ++i_;
    }
    const bool inside = i_ + 1 < imu_.size() && imu_[i_].t <= t &&
                        SecondsBetween(imu_[i_].t, imu_[i_ + 1].t) <= max_gap_;
    return inside ? std::optional<Vector3d>(sum_ + Over(t)) : std::nullopt;
  }

 private:
  // From the sample before t to t.
  Vector3d Over(TimeNs t) const {
    const ImuSample &before = imu_[i_], &after = imu_[i_ + 1];
    const double s = SecondsBetween(before.t, t), span = SecondsBetween(before.t, after.t);
    return s * (before.gyro + 0.5 * s / span * (after.gyro - before.gyro));
  }

  const std::vector<ImuSample>& imu_;
  double max_gap_;
  std::size_t i_ = 0;
  Vector3d sum_ = Vector3d::Zero();
};

// Takes the mean turn rate in I, the gyroscope's bias, out of the changes.
void SubtractBias(const std::vector<AttitudeSample>& attitude, const std::vector<double>& seconds,
                  std::vector<Vector3d>* changes) {
  Vector3d turn_I = Vector3d::Zero();
  double whole = 0.0;
  for (std::size_t i = 0; i < changes->size(); ++i) {
    turn_I += attitude[i].q_Ep_I.conjugate() * (*changes)[i];
    whole += seconds[i];
  }
  const Vector3d bias_I = turn_I / std::max(whole, 1e-9);
  for (std::size_t i = 0; i < changes->size(); ++i) {
    (*changes)[i] -= attitude[i].q_Ep_I * (seconds[i] * bias_I);
  }
}

// Root density (rad/sqrt(s), of one level axis) of the changes over blocks of some seconds. Over
// shorter ones the attitude's noise looks like a walk of the gyroscope.
double ScatterOf(const std::vector<Vector3d>& changes, const std::vector<double>& seconds) {
  constexpr double kBlock = 5.0;
  double squares = 0.0, whole = 0.0, length = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < changes.size(); ++i) {
    sum += changes[i].head<2>();
    length += seconds[i];
    if (length < kBlock) continue;
    squares += 0.5 * sum.squaredNorm();
    whole += length;
    sum.setZero();
    length = 0.0;
  }
  return whole > 0.0 ? std::sqrt(squares / whole) : std::numeric_limits<double>::infinity();
}

double RmsTilt(const std::vector<AttitudeSample>& attitude) {
  double sum = 0.0;
  for (const AttitudeSample& sample : attitude) {
    sum += 0.5 * TiltOf(sample.q_Ep_I).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(attitude.size()));
}

}  // namespace

Vector3d TiltOf(const Quaterniond& q_Ep_I) {
  const Vector3d z = q_Ep_I * Vector3d::UnitZ();
  const Vector3d turn(-z.y(), z.x(), 0.0);  // e_z x z
  const double sine = turn.norm();
  const Vector3d axis = sine > 0.0 ? Vector3d(turn / sine) : Vector3d::UnitX();
  return std::atan2(sine, z.z()) * axis;
}

double MemoryOfGyro(const std::vector<Vector3d>& changes, const std::vector<double>& seconds,
                    double tilt_rms) {
  constexpr double kShare = 0.15, kLongest = 5.0, kShortest = 0.1;
  // Forwards and backwards a random walk of this density leaves scatter sqrt(T) / 2.
  const double ratio = 2.0 * kShare * tilt_rms / std::max(ScatterOf(changes, seconds), 1e-9);
  const double memory = std::min(ratio * ratio, kLongest);
  return memory > kShortest ? memory : 0.0;
}

std::vector<Vector3d> FastPart(const std::vector<Vector3d>& changes,
                               const std::vector<double>& seconds, double memory) {
  std::vector<Vector3d> fast(changes.size() + 1, Vector3d::Zero());
  if (memory <= 0.0) return fast;
  Vector3d forward = Vector3d::Zero(), backward = forward;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    forward = std::exp(-seconds[i] / memory) * forward + changes[i];
    fast[i + 1] = 0.5 * forward;
  }
  for (std::size_t i = changes.size(); i-- > 0;) {
    backward = std::exp(-seconds[i] / memory) * backward - changes[i];
    fast[i] += 0.5 * backward;
  }
  return fast;
}

std::vector<AttitudeSample> SmoothAttitude(const std::vector<ImuSample>& imu,
                                           const std::vector<AttitudeSample>& attitude,
                                           double max_gap) {
  if (attitude.empty() || imu.empty()) return attitude;
  std::vector<Vector3d> changes;  // rad in E', of the attitude less those of the gyroscope
  std::vector<double> seconds;
  GyroCursor gyro(imu, max_gap);
  auto begin = gyro.At(attitude.front().t);
  for (std::size_t i = 0; i + 1 < attitude.size(); ++i) {
    const auto end = gyro.At(attitude[i + 1].t);
    seconds.push_back(SecondsBetween(attitude[i].t, attitude[i + 1].t));
    Vector3d change = Vector3d::Zero();
    if (begin && end && seconds.back() <= max_gap) {
      const Quaterniond turned = attitude[i].q_Ep_I * RotationByVector(*end - *begin);
      change = RotationVector(attitude[i + 1].q_Ep_I * turned.conjugate());
    }
    changes.push_back(change);
    begin = end;
  }
  SubtractBias(attitude, seconds, &changes);
  const double memory = MemoryOfGyro(changes, seconds, RmsTilt(attitude));
  const std::vector<Vector3d> fast = FastPart(changes, seconds, memory);
  std::vector<AttitudeSample> smooth = attitude;
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    smooth[i].q_Ep_I = RotationByVector(-fast[i]) * attitude[i].q_Ep_I;
  }
  return smooth;
}

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

namespace {

constexpr double kTolerated = 0.3 * kDegree;  // tilt error that the gyroscope may add over a hold
constexpr double kShortestHold = 3.0;         // s
constexpr double kLeastTime = 5.0;            // s of log, below which nothing is concluded

// s before the log in which manoeuvres like the log's own may have filled the filter's integral.
constexpr double kFilledBefore = 30.0;

// Memory of a filter: s in which an error without hold decays to 1/e.
constexpr double kForgetsBias = 10.0;
constexpr double kForgetsPull = 30.0;

// Root density of consecutive residuals (rows of x and y, over these seconds) over runs of `count`.
double Density(const Eigen::MatrixX2d& residuals, const Eigen::VectorXd& seconds,
               Eigen::Index count) {
  double sum = 0.0;
  const Eigen::Index runs = residuals.rows() / count;
  for (Eigen::Index k = 0; k < runs; ++k) {
    sum += residuals.middleRows(k * count, count).colwise().sum().squaredNorm();
  }
  const double all = seconds.head(runs * count).sum();
  return all > 0.0 ? std::sqrt(sum / (2.0 * all)) : 0.0;
}

// A state that follows its input through a first-order low-pass.
template <class State>
void Follow(const State& input, double seconds, double memory, State* state) {
  *state += -std::expm1(-seconds / memory) * (input - *state);
}

// A state that sums its input and decays.
template <class State>
void Accumulate(const State& increment, double seconds, double memory, State* state) {
  *state = std::exp(-seconds / memory) * *state + increment;
}

// Square root of sigma^2 I + v v'.
Eigen::Matrix3d RootOfSum(double sigma, const Vector3d& v) {
  const double norm = v.norm();
  const Eigen::Matrix3d isotropic = sigma * Eigen::Matrix3d::Identity();
  if (norm == 0.0) return isotropic;
  return isotropic + (std::hypot(sigma, norm) - sigma) / (norm * norm) * v * v.transpose();
}

template <class Entry>
void SubtractMean(std::vector<Entry>* entries) {
  Entry sum = Entry::Zero();
  for (const Entry& entry : *entries) sum += entry;
  sum /= static_cast<float>(entries->size());
  for (Entry& entry : *entries) entry -= sum;
}

}  // namespace

AttitudeErrors::AttitudeErrors(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                               const AttitudeErrorOptions& options) {
  intervals_ = GyroIntervals(log.imu, attitude, options.latency, options.max_gap);
  if (intervals_.empty()) return;
  begin_ = log.imu.front().t;
  for (GyroInterval& interval : intervals_) {
    if (!options.uses_accelerometer) interval.pull = interval.pull_I = Vector3d::Zero();
  }
  if (CoveredSeconds().sum() >= kLeastTime) {
    Fit();
    const double ratio = kTolerated / std::max(fit_.scatter, 1e-9);
    hold_ = std::min(2.0 * ratio * ratio, options.longest_hold);
    if (hold_ < kShortestHold) hold_ = 0.0;
  }
  Integrate(options.priors);
  intervals_.clear();
}

// s of each interval in which the attitude is known.
Eigen::VectorXd AttitudeErrors::CoveredSeconds() const {
  Eigen::VectorXd seconds(static_cast<Eigen::Index>(intervals_.size()));
  for (Eigen::Index k = 0; k < seconds.size(); ++k) {
    seconds[k] = intervals_[static_cast<std::size_t>(k)].seconds;
  }
  return seconds;
}

// The change of the error is the turn plus R_Ep_I times the gyroscope's bias: the turn is -b, what
// the accelerometer's tilt feeds back, and its integral.
void AttitudeErrors::Fit() {
  constexpr int kUnknowns = 5;
  const auto count = static_cast<Eigen::Index>(intervals_.size());
  const Eigen::Matrix<double, Eigen::Dynamic, kUnknowns> slopes = FilterSlopes(intervals_);
  Eigen::MatrixXd A(2 * count, kUnknowns);
  Eigen::VectorXd y(2 * count);
  Vector3d pull = Vector3d::Zero();  // rad s, in I
  for (Eigen::Index k = 0; k < count; ++k) {
    const GyroInterval& interval = intervals_[static_cast<std::size_t>(k)];
    A.middleRows<2>(2 * k) = slopes.middleRows<2>(3 * k);
    y.segment<2>(2 * k) = interval.turn.head<2>();
    pull += interval.pull_I;
  }
  // Broad priors keep what a log does not show at zero.
  Eigen::Matrix<double, kUnknowns, 1> weak;
  weak << 1e-6, 1e-6, 1e-6, 1e-8, 1e-8;
  Eigen::Matrix<double, kUnknowns, kUnknowns> H = A.transpose() * A;
  H.diagonal() += weak;
  const Eigen::Matrix<double, kUnknowns, 1> x = H.ldlt().solve(A.transpose() * y);
  fit_.gyro_bias = x.head<3>();
  fit_.k_p = x[3];
  fit_.k_i = x[4];
  const Eigen::VectorXd seconds = CoveredSeconds();
  fit_.pull = pull / seconds.sum();
  const Eigen::VectorXd rest = y - A * x;
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>> rows(
      rest.data(), count, 2);
  fit_.scatter = std::max(Density(rows, seconds, 10), Density(rows, seconds, 40));
}

// rad, the change of the attitude's error: its turn but for the gyroscope's bias.
Vector3d AttitudeErrors::ErrorChange(const GyroInterval& interval) const {
  return interval.turn + interval.axes * fit_.gyro_bias;
}

// rad, the vehicle's tilt at the intervals' ends, its fast changes by the gyroscope.
std::vector<Vector3d> AttitudeErrors::SmoothTilts() const {
  std::vector<Vector3d> changes, tilts;
  std::vector<double> seconds;
  double squares = 0.0;
  for (std::size_t k = 0; k < intervals_.size(); ++k) {
    tilts.push_back(intervals_[k].tilt);
    squares += 0.5 * tilts.back().squaredNorm();
    if (k == 0) continue;
    changes.push_back(ErrorChange(intervals_[k]));
    seconds.push_back(intervals_[k].seconds);
  }
  const double rms = std::sqrt(squares / std::max<double>(1.0, static_cast<double>(tilts.size())));
  const std::vector<Vector3d> fast =
      FastPart(changes, seconds, MemoryOfGyro(changes, seconds, rms));
  for (std::size_t k = 0; k < tilts.size(); ++k) tilts[k] -= fast[k];
  return tilts;
}

void AttitudeErrors::Integrate(const AttitudeErrorPriors& priors) {
  const bool held = hold_ > 0.0;
  const double duration = std::max(ToSeconds(kGyroInterval), CoveredSeconds().sum());
  double bias_sigma = priors.gyro_bias;
  if (bias_sigma > 0.0) bias_sigma += held ? 2.0 * fit_.scatter / std::sqrt(duration) : bias_sigma;
  // The fit sees the integral as a bias of the gyroscope, and what filled it before the log as
  // well.
  const Eigen::Matrix3d bias_root =
      RootOfSum(bias_sigma,
                held ? Vector3d(kFilledBefore * fit_.k_i * fit_.pull) : Vector3d(Vector3d::Zero()));
  Vector3d feedback = Vector3d::Zero(), pull = Vector3d::Zero();
  Eigen::Matrix3d by_bias = Eigen::Matrix3d::Zero();
  Vector3d by_gain = Vector3d::Zero(), by_share = Vector3d::Zero();
  const std::vector<Vector3d> tilts = SmoothTilts();
  for (std::size_t k = 0; k < intervals_.size(); ++k) {
    const GyroInterval& interval = intervals_[k];
    const double h = interval.seconds;
    Accumulate<Eigen::Matrix3d>(interval.axes, h, held ? hold_ : kForgetsBias, &by_bias);
    Accumulate<Vector3d>(interval.pull, h, kForgetsPull, &pull);
    if (held) {
      Accumulate<Vector3d>(ErrorChange(interval), h, hold_, &feedback);
      Follow(pull, h, hold_, &by_gain);  // what a hold leaves of an error is its low-pass
      Follow(tilts[k], h, hold_, &by_share);
    } else {
      by_gain = pull;
      by_share = tilts[k];
    }
    // The angles of E' against E have the opposite sign of the attitude's error.
    Slopes slopes;
    slopes << -by_bias * bias_root, -priors.gain * by_gain, -priors.share * by_share;
    slopes.row(2).setZero();  // the heading is the filter's own
    slopes_.push_back(slopes.cast<float>());
    feedback_.emplace_back(feedback.x(), feedback.y(), 0.0F);
  }
  SubtractMean(&slopes_);
  SubtractMean(&feedback_);
}

std::size_t AttitudeErrors::IntervalAt(TimeNs t) const {
  const TimeNs k = std::max<TimeNs>(0, t - begin_) / kGyroInterval;
  return std::min(static_cast<std::size_t>(k), slopes_.size() - 1);
}

Vector3d AttitudeErrors::FeedbackAt(TimeNs t) const {
  // Entries are of the intervals' ends.
  const std::size_t k = IntervalAt(t), before = k > 0 ? k - 1 : k;
  const double since = SecondsBetween(begin_ + static_cast<TimeNs>(k) * kGyroInterval, t);
  const auto s = static_cast<float>(std::clamp(since / ToSeconds(kGyroInterval), 0.0, 1.0));
  return ((1.0F - s) * feedback_[before] + s * feedback_[k]).cast<double>();
}

Quaterniond AttitudeErrors::Corrected(TimeNs t, const Quaterniond& q_Ep_I) const {
  return hold_ > 0.0 ? RotationByVector(-FeedbackAt(t)) * q_Ep_I : q_Ep_I;
}

Quaterniond AttitudeErrors::Logged(TimeNs t, const Quaterniond& corrected) const {
  return hold_ > 0.0 ? RotationByVector(FeedbackAt(t)) * corrected : corrected;
}

AttitudeErrors::Slopes AttitudeErrors::MeanOver(TimeNs t0, TimeNs t1) const {
  if (slopes_.empty()) return Slopes::Zero();
  const std::size_t first = IntervalAt(t0), last = std::max(first, IntervalAt(t1 - 1));
  Slopes sum = Slopes::Zero();
  for (std::size_t k = first; k <= last; ++k) sum += slopes_[k].cast<double>();
  return sum / static_cast<double>(last - first + 1);
}

}  // namespace trueline
