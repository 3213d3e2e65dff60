// Gusts: a horizontal specific force in E, modelled as a Gauss-Markov process sampled at the ends
// of segments and linear between them. Gusts and a tilt of the AHRS change the path alike; drag and
// the accelerometer's x, y measure gusts only. What acts along the accelerometer's z is part of its
// reading, so only the rest of a gust adds to the motion. A vehicle leans into a gust g: were all
// of it added, the mean of the thrust would be off by about g^2 / gravity.
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

// Derivative of (p_E, v_E) to both gusts, from a segment's start on.
class StateByGusts {
 public:
  using Slope = Eigen::Matrix<double, 6, 2 * kGustSize>;

  // seconds: the segment's length.
  explicit StateByGusts(double seconds) : seconds_(seconds) {}

  // On to `t` (s from the segment's start). thrust_axis: unit vector in E along which the
  // accelerometer measures all force, on the way there.
  void Advance(double t, const Eigen::Vector3d& thrust_axis) {
    const GustGain to = GustGainAt(t, seconds_);
    const double dt = t - t_;
    Eigen::Matrix<double, 3, kGustSize> across;
    across << Eigen::Matrix2d::Identity(), Eigen::RowVector2d::Zero();
    across -= thrust_axis * thrust_axis.head<kGustSize>().transpose();
    d_.topRows<3>() += dt * d_.bottomRows<3>();
    d_.topLeftCorner<3, 2>() += (to.p0 - at_.p0 - dt * at_.v0) * across;
    d_.topRightCorner<3, 2>() += (to.p1 - at_.p1 - dt * at_.v1) * across;
    d_.bottomLeftCorner<3, 2>() += (to.v0 - at_.v0) * across;
    d_.bottomRightCorner<3, 2>() += (to.v1 - at_.v1) * across;
    at_ = to;
    t_ = t;
  }

  const Slope& d() const { return d_; }

 private:
  double seconds_, t_ = 0.0;
  GustGain at_{0.0, 0.0, 0.0, 0.0};
  Slope d_ = Slope::Zero();
};

}  // namespace trueline
