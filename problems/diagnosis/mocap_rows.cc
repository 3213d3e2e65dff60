#include "problems/diagnosis/mocap_rows.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

#include "cost_functions/models/rotation.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/log/imu_health.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// The kernel (1 - u^2)^4 and its second derivative; both vanish smoothly at u = +-1.
double Kernel(double u) { return std::pow(std::max(0.0, 1.0 - u * u), 4); }
double KernelBend(double u) {
  const double w = std::max(0.0, 1.0 - u * u);
  return w * w * (48.0 * u * u - 8.0 * w);
}

Quaterniond Between(const Quaterniond& a, const Quaterniond& b, double share) {
  const double sign = a.dot(b) < 0.0 ? -1.0 : 1.0;
  return Quaterniond((1.0 - share) * a.coeffs() + share * sign * b.coeffs()).normalized();
}

// Weight of sample i in the trapezoidal rule over all samples, s.
template <class Sample>
double Weight(std::span<const Sample> samples, std::size_t i) {
  const std::size_t before = i > 0 ? i - 1 : i, after = i + 1 < samples.size() ? i + 1 : i;
  return 0.5 * SecondsBetween(samples[before].t, samples[after].t);
}

// By samples near `near`, which moves on.
template <class Sample>
Quaterniond AttitudeAt(const std::vector<Sample>& samples, Quaterniond Sample::*q, TimeNs t,
                       std::size_t* near) {
  std::size_t& i = *near;
  while (i + 2 < samples.size() && samples[i + 1].t <= t) ++i;
  const Sample &a = samples[i], &b = samples[i + 1];
  const double share = std::clamp(SecondsBetween(a.t, t) / SecondsBetween(a.t, b.t), 0.0, 1.0);
  return Between(a.*q, b.*q, share);
}

StreamRows EmptyRows(std::size_t samples, int nuisances) {
  const auto rows = static_cast<Eigen::Index>(3 * samples);
  return {{}, Eigen::VectorXd::Zero(rows), Eigen::MatrixXd::Zero(rows, nuisances)};
}

}  // namespace

MocapComparison::MocapComparison(const FlightLog& log) : log_(log) {
  const auto& mocap = log.mocap;
  if (mocap.size() < 10) return;
  double low = mocap.front().p_E.z(), high = low;
  for (std::size_t i = 0; i < mocap.size(); ++i) {
    low = std::min(low, mocap[i].p_E.z());
    high = std::max(high, mocap[i].p_E.z());
    if (i > 0 && SecondsBetween(mocap[i - 1].t, mocap[i].t) > kMocapGap) {
      gaps_.push_back({mocap[i - 1].t, mocap[i].t});
    }
  }
  has_height_ = high - low > 1e-6;
  const TimeNs margin = FromSeconds(kMovedBy);
  TimeNs next = mocap.front().t;
  for (std::size_t i = 0; i < log.attitude.size(); ++i) {
    const TimeNs t = log.attitude[i].t;
    if (t < next || !Covers(t - margin, t + margin)) continue;
    attitude_.push_back(i);
    next = t + FromSeconds(kAttitudeSpacing);
  }
  for (std::size_t i = 0; i < log.fixes.size(); ++i) {
    const TimeNs t = log.fixes[i].t;
    if (log.fixes[i].gate >= 0 && Covers(t - margin, t + margin)) fixes_.push_back(i);
  }
  const std::vector<Vector3d> velocity = PathVelocity(mocap);
  for (std::size_t i = 0; i < mocap.size(); ++i) {
    if (path_.empty() || SecondsBetween(path_.back().t, mocap[i].t) > 0.095) {
      path_.push_back({mocap[i].t, velocity[i]});
    }
  }
  FindWindows();
  AlignHeadings();
}

bool MocapComparison::Covers(TimeNs from, TimeNs to) const {
  if (from < log_.mocap.front().t || to > log_.mocap.back().t) return false;
  return std::ranges::none_of(gaps_,
                              [&](const Gap& gap) { return gap.from < to && gap.to > from; });
}

std::optional<PoseSample> MocapComparison::PoseAt(TimeNs t) const {
  const auto p_E = PositionAt(log_.mocap, t);
  if (!p_E) return std::nullopt;
  const auto after = std::ranges::lower_bound(log_.mocap, t, {}, &PoseSample::t);
  if (after == log_.mocap.begin()) return log_.mocap.front();
  const PoseSample &a = *std::prev(after), &b = *after;
  const double share = SecondsBetween(a.t, t) / SecondsBetween(a.t, b.t);
  return PoseSample{t, *p_E, Between(a.q_E, b.q_E, share)};
}

// The integral of kernel'' p is that of kernel p''. A chord is taken off first: its bend is zero,
// but not that of the trapezoidal rule.
Vector3d MocapComparison::SecondDerivative(TimeNs middle) const {
  const TimeNs reach = FromSeconds(reach_);
  const auto mocap = SamplesBetween(log_.mocap, middle - reach, middle + reach);
  const PoseSample &first = mocap.front(), &last = mocap.back();
  const Vector3d slope = (last.p_E - first.p_E) / SecondsBetween(first.t, last.t);
  Vector3d sum = Vector3d::Zero();
  double weights = 0.0;
  for (std::size_t i = 0; i < mocap.size(); ++i) {
    const double u = SecondsBetween(middle, mocap[i].t) / reach_;
    const double span = Weight(mocap, i);
    const Vector3d chord = first.p_E + slope * SecondsBetween(first.t, mocap[i].t);
    sum += span * KernelBend(u) * (mocap[i].p_E - chord);
    weights += span * Kernel(u);
  }
  return sum / (weights * reach_ * reach_);
}

void MocapComparison::FindWindows() {
  constexpr double kShortest = 0.2;  // s
  constexpr double kSamples = 10.0;  // of mocap, to either side
  const double interval = MedianStep(log_.mocap);
  reach_ = std::max(kShortest, kSamples * interval);
  const TimeNs reach = FromSeconds(reach_), margin = FromSeconds(kMovedBy);
  const TimeNs end = std::min(log_.mocap.back().t, log_.imu.back().t) - reach - margin;
  TimeNs t = std::max(log_.mocap.front().t, log_.imu.front().t) + reach + margin;
  for (; t < end; t += reach) {
    const auto mocap = SamplesBetween(log_.mocap, t - reach, t + reach);
    bool whole = mocap.size() > static_cast<std::size_t>(kSamples);
    for (std::size_t i = 1; i < mocap.size(); ++i) {
      whole = whole && SecondsBetween(mocap[i - 1].t, mocap[i].t) < 3.0 * interval;
    }
    if (whole && Covers(t - reach, t + reach)) windows_.push_back({t, SecondDerivative(t)});
  }
}

// The mean rotation from E' to E. If mocap has no attitude of its own, the heading at which both
// horizontal accelerations agree.
void MocapComparison::AlignHeadings() {
  constexpr double kSame = 5e-4;  // rad, of an attitude that is a copy
  if (log_.attitude.size() < 2 || attitude_.empty()) {
    own_attitude_ = log_.attitude.empty();
    return;
  }
  std::vector<double> angles;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  std::size_t near = 0;
  for (const PoseSample& pose : log_.mocap) {
    if (pose.t < log_.attitude.front().t || pose.t > log_.attitude.back().t) continue;
    const Quaterniond q =
        pose.q_E * AttitudeAt(log_.attitude, &AttitudeSample::q_Ep_I, pose.t, &near).conjugate();
    angles.push_back(RotationVector(q).norm());
    sum += sum.dot(q.coeffs()) < 0.0 ? Eigen::Vector4d(-q.coeffs()) : q.coeffs();
  }
  if (angles.empty()) return;
  own_attitude_ = UpperMedian(angles) > kSame;
  if (own_attitude_) {
    q_E_Ep_ = Quaterniond(sum).normalized();
    return;
  }
  const StreamRows rows = Acceleration(log_);
  double along = 0.0, across = 0.0;
  for (std::size_t i = 0; i < windows_.size(); ++i) {
    const Vector3d& a_E = windows_[i].a_E;
    const Vector3d a_Ep = rows.r.segment<3>(3 * static_cast<Eigen::Index>(i)) + a_E;
    along += a_Ep.head<2>().dot(a_E.head<2>());
    across += a_Ep.x() * a_E.y() - a_Ep.y() * a_E.x();
  }
  q_E_Ep_ = Eigen::AngleAxisd(std::atan2(across, along), Vector3d::UnitZ());
}

std::vector<Quaterniond> MocapComparison::AttitudesOfImu(const FlightLog& corrected) const {
  std::vector<Quaterniond> q_E_I;
  q_E_I.reserve(corrected.imu.size());
  std::size_t near = 0;
  for (const ImuSample& s : corrected.imu) {
    q_E_I.push_back(own_attitude_ ? AttitudeAt(log_.mocap, &PoseSample::q_E, s.t, &near)
                                  : q_E_Ep_ * AttitudeAt(corrected.attitude,
                                                         &AttitudeSample::q_Ep_I, s.t, &near));
  }
  return q_E_I;
}

void MocapComparison::RemoveHeight(StreamRows* rows) const {
  if (has_height_) return;
  for (Eigen::Index row = 2; row < rows->r.size(); row += 3) {
    rows->r[row] = 0.0;
    rows->nuisances.row(row).setZero();
  }
}

FlightLog MocapComparison::WithFixesOnPath() const {
  FlightLog log = log_;
  for (Fix& fix : log.fixes) {
    if (const auto p_E = PositionAt(log_.mocap, fix.t)) fix.p_E = *p_E;
  }
  return log;
}

StreamRows MocapComparison::Attitude(const FlightLog& corrected) const {
  StreamRows rows = EmptyRows(attitude_.size(), 6);
  for (const std::size_t i : attitude_) {
    const auto row = static_cast<Eigen::Index>(3 * rows.t.size());
    const AttitudeSample& s = corrected.attitude[i];
    const auto pose = PoseAt(s.t);
    rows.t.push_back(SecondsBetween(log_.imu.front().t, s.t));
    if (!pose) continue;
    rows.r.segment<3>(row) = RotationVector(q_E_Ep_ * s.q_Ep_I * pose->q_E.conjugate());
    rows.nuisances.block<3, 3>(row, 0).setIdentity();
    rows.nuisances.block<3, 3>(row, 3) = pose->q_E.toRotationMatrix();
  }
  return rows;
}

StreamRows MocapComparison::Acceleration(const FlightLog& corrected) const {
  StreamRows rows = EmptyRows(windows_.size(), own_attitude_ ? 9 : 10);
  if (!own_attitude_ && log_.attitude.size() < 2) return {};
  const std::vector<Quaterniond> q_E_I = AttitudesOfImu(corrected);
  for (const Window& window : windows_) {
    const auto row = static_cast<Eigen::Index>(3 * rows.t.size());
    rows.t.push_back(SecondsBetween(log_.imu.front().t, window.middle));
    const TimeNs reach = FromSeconds(reach_);
    const auto imu = SamplesBetween(corrected.imu, window.middle - reach, window.middle + reach);
    const auto first = static_cast<std::size_t>(imu.data() - corrected.imu.data());
    double weights = 0.0;
    Vector3d f_E = Vector3d::Zero();
    Matrix3d turned = Matrix3d::Zero(), misaligned = Matrix3d::Zero();
    for (std::size_t i = 0; i < imu.size(); ++i) {
      const double u = SecondsBetween(window.middle, imu[i].t) / reach_;
      const double weight = Weight(imu, i) * Kernel(u);
      const Matrix3d R_E_I = q_E_I[first + i].toRotationMatrix();
      weights += weight;
      f_E += weight * (R_E_I * imu[i].accel);
      turned += weight * R_E_I;
      misaligned += weight * (R_E_I * Skew(imu[i].accel));
    }
    if (!(weights > 0.0)) continue;
    f_E /= weights;
    rows.r.segment<3>(row) = f_E + log_.gravity * Vector3d::UnitZ() - window.a_E;
    rows.nuisances.block<3, 3>(row, 0) = turned / weights;
    rows.nuisances.block<3, 3>(row, 3) = misaligned / weights;
    rows.nuisances.block<3, 3>(row, 6) = Skew(f_E);
    if (!own_attitude_) rows.nuisances.block<3, 1>(row, 9) = f_E;
  }
  RemoveHeight(&rows);
  return rows;
}

StreamRows MocapComparison::Fixes(const FlightLog& corrected) const {
  StreamRows rows = EmptyRows(fixes_.size(), 4);
  for (const std::size_t i : fixes_) {
    const auto row = static_cast<Eigen::Index>(3 * rows.t.size());
    const Fix& fix = corrected.fixes[i];
    rows.t.push_back(SecondsBetween(log_.imu.front().t, fix.t));
    const auto p_E = PositionAt(log_.mocap, fix.t);
    if (!p_E) continue;
    rows.r.segment<3>(row) = (fix.p_E - *p_E) / fix.sigma;
    rows.nuisances.block<3, 3>(row, 0) = Matrix3d::Identity() / fix.sigma;
    rows.nuisances.block<3, 1>(row, 3) = Vector3d(-p_E->y(), p_E->x(), 0.0) / fix.sigma;
  }
  RemoveHeight(&rows);
  return rows;
}

}  // namespace trueline
