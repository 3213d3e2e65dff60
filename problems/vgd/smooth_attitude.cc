#include "problems/vgd/smooth_attitude.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "cost_functions/models/rotation.h"

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

}  // namespace trueline
