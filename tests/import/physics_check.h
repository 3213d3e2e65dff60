// Checks that a converted flight obeys physics: mocap position differentiated twice must equal the
// specific force rotated to earth axes plus gravity. Independent of the library's models.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

using Signal = std::vector<Eigen::Vector3d>;  // at 100 Hz

constexpr double kStep = 0.01;  // s

template <class Sample, class Value>
Signal Resample(const std::vector<Sample>& samples, TimeNs from, TimeNs to, const Value& value) {
  Signal signal;
  std::size_t k = 0;
  for (TimeNs t = from; t <= to; t += FromSeconds(kStep)) {
    while (k + 2 < samples.size() && samples[k + 1].t <= t) ++k;
    const double span = SecondsBetween(samples[k].t, samples[k + 1].t);
    const double share = std::clamp(SecondsBetween(samples[k].t, t) / span, 0.0, 1.0);
    signal.push_back((1.0 - share) * value(samples[k]) + share * value(samples[k + 1]));
  }
  return signal;
}

// Three boxcars of 0.21 s: nothing above about 3 Hz is left.
inline Signal Smooth(Signal signal) {
  constexpr int kHalf = 10;
  for (int pass = 0; pass < 3; ++pass) {
    Signal next = signal;
    const int n = static_cast<int>(signal.size());
    for (int i = kHalf; i + kHalf < n; ++i) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int j = i - kHalf; j <= i + kHalf; ++j) sum += signal[static_cast<std::size_t>(j)];
      next[static_cast<std::size_t>(i)] = sum / (2 * kHalf + 1);
    }
    signal = std::move(next);
  }
  return signal;
}

struct Agreement {
  Eigen::Vector3d correlation = Eigen::Vector3d::Zero();  // by axis of E
  Eigen::Vector3d rms = Eigen::Vector3d::Zero();          // m/s^2, of the difference less its mean
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();         // m/s^2, of the difference
};

inline Agreement Compare(const Signal& a, const Signal& b, const std::vector<bool>& use) {
  Eigen::Array3d sa = Eigen::Array3d::Zero(), sb = sa, saa = sa, sbb = sa, sab = sa;
  double n = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!use[i]) continue;
    const Eigen::Array3d x = a[i].array(), y = b[i].array();
    sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y, n += 1.0;
  }
  const Eigen::Array3d vaa = saa / n - (sa / n).square();
  const Eigen::Array3d vbb = sbb / n - (sb / n).square();
  const Eigen::Array3d vab = sab / n - sa * sb / (n * n);
  return {(vab / (vaa * vbb).sqrt()).matrix(), (vaa + vbb - 2.0 * vab).max(0.0).sqrt().matrix(),
          ((sa - sb) / n).matrix()};
}

// Instants with fresh mocap for 0.6 s on either side.
inline std::vector<bool> FreshMocap(const FlightLog& log, TimeNs from, std::size_t count) {
  std::vector<bool> fresh(count, true);
  for (std::size_t k = 1; k < log.mocap.size(); ++k) {
    if (SecondsBetween(log.mocap[k - 1].t, log.mocap[k].t) < 0.15) continue;
    const auto limit = static_cast<double>(count);
    const double first = SecondsBetween(from, log.mocap[k - 1].t) / kStep - 60.0;
    const double last = SecondsBetween(from, log.mocap[k].t) / kStep + 60.0;
    const auto begin = static_cast<std::ptrdiff_t>(std::clamp(first, 0.0, limit));
    const auto end = static_cast<std::ptrdiff_t>(std::clamp(last, 0.0, limit));
    std::fill(fresh.begin() + begin, fresh.begin() + end, false);
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(60, count); ++i) {
    fresh[i] = fresh[count - 1 - i] = false;
  }
  return fresh;
}

enum class Thrust { kAccelerometer, kLevelFlight };
enum class AttitudeOf { kAhrs, kMocap };

// Specific force in E against twice differentiated mocap less gravity.
inline Agreement CheckPhysics(const FlightLog& log, AttitudeOf attitude_of, Thrust thrust) {
  std::vector<AttitudeSample> attitude = log.attitude;
  if (attitude_of == AttitudeOf::kMocap) {
    attitude.clear();
    for (const PoseSample& pose : log.mocap) attitude.push_back({pose.t, pose.q_E});
  }
  const TimeNs from = std::max({log.imu.front().t, log.mocap.front().t, attitude.front().t});
  const TimeNs to = std::min({log.imu.back().t, log.mocap.back().t, attitude.back().t});
  const auto column = [&](int k) {
    return Resample(attitude, from, to, [k](const AttitudeSample& s) -> Eigen::Vector3d {
      return s.q_Ep_I.toRotationMatrix().col(k);
    });
  };
  const Signal x = column(0), y = column(1), z = column(2);
  Signal force = Resample(log.imu, from, to, [](const ImuSample& s) { return s.accel; });
  for (std::size_t i = 0; i < force.size(); ++i) {
    const Eigen::Vector3d f = force[i];
    force[i] = thrust == Thrust::kLevelFlight
                   ? Eigen::Vector3d(-9.81 / z[i].z() * z[i])
                   : Eigen::Vector3d(f.x() * x[i] + f.y() * y[i] + f.z() * z[i]);
  }
  const Signal p = Smooth(Resample(log.mocap, from, to, [](const PoseSample& s) { return s.p_E; }));
  Signal expected(p.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 5; i + 5 < p.size(); ++i) {
    expected[i] = (p[i + 5] - 2.0 * p[i] + p[i - 5]) / (25.0 * kStep * kStep);
    expected[i].z() -= 9.81;
  }
  return Compare(Smooth(force), expected, FreshMocap(log, from, p.size()));
}

// Mean angle (deg) between the AHRS's attitude and mocap's, and correlation of turn rates with the
// gyro, by body axis.
inline double AttitudeDifference(const FlightLog& log) {
  double sum = 0.0;
  std::size_t count = 0;
  std::size_t k = 0;
  for (const PoseSample& pose : log.mocap) {
    while (k + 1 < log.attitude.size() && log.attitude[k + 1].t <= pose.t) ++k;
    if (std::abs(SecondsBetween(log.attitude[k].t, pose.t)) > 0.05) continue;
    sum += log.attitude[k].q_Ep_I.angularDistance(pose.q_E) * 180.0 / M_PI;
    ++count;
  }
  return sum / static_cast<double>(count);
}

inline Agreement CheckRates(const FlightLog& log, AttitudeOf attitude_of) {
  std::vector<AttitudeSample> attitude = log.attitude;
  if (attitude_of == AttitudeOf::kMocap) {
    attitude.clear();
    for (const PoseSample& pose : log.mocap) attitude.push_back({pose.t, pose.q_E});
  }
  const TimeNs from = std::max(log.imu.front().t, attitude.front().t);
  const TimeNs to = std::min(log.imu.back().t, attitude.back().t);
  std::vector<ImuSample> turn;  // rate of the attitude between neighbours, in the body
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    const double span = SecondsBetween(attitude[i - 1].t, attitude[i].t);
    if (span > 0.15) continue;
    const Eigen::AngleAxisd step(attitude[i - 1].q_Ep_I.conjugate() * attitude[i].q_Ep_I);
    const double angle = std::remainder(step.angle(), 2.0 * M_PI);
    const TimeNs middle = attitude[i - 1].t + (attitude[i].t - attitude[i - 1].t) / 2;
    turn.push_back({middle, Eigen::Vector3d::Zero(), angle / span * step.axis()});
  }
  const auto rate = [](const ImuSample& s) { return s.gyro; };
  const Signal a = Smooth(Resample(turn, from, to, rate));
  const Signal b = Smooth(Resample(log.imu, from, to, rate));
  std::vector<bool> use(a.size(), true);
  for (std::size_t i = 0; i < std::min<std::size_t>(60, a.size()); ++i) {
    use[i] = use[a.size() - 1 - i] = false;
  }
  return Compare(a, b, use);
}

}  // namespace trueline
