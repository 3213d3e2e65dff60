// Gusts: a horizontal specific force in E, modelled as a Gauss-Markov process sampled at the ends
// of segments and linear between them. Gusts and a tilt of the AHRS change the path alike; drag and
// the accelerometer's x, y measure gusts only.
#pragma once

#include <Eigen/Core>

namespace trueline {

inline constexpr int kGustSize = 2;  // x and y in E, m/s^2

// Change of (p, v) after t seconds by a gust that is linear from g0 to g1 (m/s^2) over h seconds,
// as factors of g0 and g1.
struct GustGain {
  double p0, p1;  // s^2
  double v0, v1;  // s
};

inline GustGain GustGainAt(double t, double h) {
  const double t2 = t * t;
  return {t2 / 2 - t2 * t / (6 * h), t2 * t / (6 * h), t - t2 / (2 * h), t2 / (2 * h)};
}

// The gusts at both ends of a segment: g0, then g1.
using GustPair = Eigen::Matrix<double, 2 * kGustSize, 1>;

// Derivative of (p_E, v_E) at t to both gusts.
inline Eigen::Matrix<double, 6, 2 * kGustSize> StateByGusts(double t, double h) {
  const GustGain gain = GustGainAt(t, h);
  Eigen::Matrix<double, 6, 2 * kGustSize> d = Eigen::Matrix<double, 6, 2 * kGustSize>::Zero();
  for (int i = 0; i < kGustSize; ++i) {
    d(i, i) = gain.p0;
    d(i, kGustSize + i) = gain.p1;
    d(3 + i, i) = gain.v0;
    d(3 + i, kGustSize + i) = gain.v1;
  }
  return d;
}

}  // namespace trueline
