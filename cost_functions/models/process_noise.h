// Process noise of the IMU-driven model. Unmodelled acceleration is white noise (the velocity does
// a random walk). The drift of the AHRS error about its constant part is a Gauss-Markov process,
// which tilts gravity into the horizontal; with a long memory it becomes a Wiener process. Gusts,
// which the accelerometer measures, are another Gauss-Markov process.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace trueline {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

struct ProcessNoise {
  double acceleration = 0.0;   // m/s^2/sqrt(Hz), across the thrust
  double thrust_factor = 1.0;  // on it along the thrust, where the accelerometer's own noise acts
  double tilt = 0.0;           // rad, stationary sigma of the drift of phi and theta of E'
  double heading = 0.0;        // rad, the same of psi
  double memory = 1.0;         // s, time in which the drift falls to 1/e
  double gust = 0.0;           // m/s^2, stationary sigma of each horizontal axis
  double gust_memory = 0.8;    // s

  bool Any() const { return acceleration > 0.0 || tilt > 0.0 || heading > 0.0; }
  // Factor by which the drift decays in `seconds`.
  double Decay(double seconds) const { return std::exp(-seconds / memory); }
  double GustDecay(double seconds) const { return std::exp(-seconds / gust_memory); }
  // Sigma of the change of a gust in `seconds`, m/s^2.
  double GustStepSigma(double seconds) const {
    const double beta = GustDecay(seconds);
    return gust * std::sqrt(1.0 - beta * beta);
  }
  Eigen::Vector3d DriftSigma() const { return {tilt, tilt, heading}; }
  // Sigma of the drift where a chain starts, rad. The floor keeps its weight finite.
  Eigen::Vector3d StartSigma() const { return DriftSigma().cwiseMax(1e-5); }
};

// Covariance of (p_E, v_E, drift) after `seconds`, starting from zero: dp = v, dv = M drift +
// noise, M drift = g (-theta, phi, 0), exact for a specific force of (0, 0, -g). The drift does a
// random walk at the rate that keeps its stationary sigma. thrust_axis: unit vector in E. Units m,
// m/s, rad.
inline Matrix9d ProcessCovariance(const ProcessNoise& noise, double seconds, double gravity,
                                  const Eigen::Vector3d& thrust_axis) {
  const double t = seconds, t2 = t * t, t3 = t2 * t;
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  M(0, 1) = -gravity;
  M(1, 0) = gravity;
  const double along = noise.thrust_factor * noise.thrust_factor - 1.0;
  const Eigen::Matrix3d q_a =
      noise.acceleration * noise.acceleration *
      (Eigen::Matrix3d::Identity() + along * thrust_axis * thrust_axis.transpose());
  const double alpha = noise.Decay(t);
  const Eigen::Matrix3d Q =
      ((1.0 - alpha * alpha) / t * noise.DriftSigma().cwiseAbs2()).asDiagonal();
  const Eigen::Matrix3d MQ = M * Q, MQM = MQ * M.transpose();
  Matrix9d cov;
  cov.block<3, 3>(0, 0) = q_a * (t3 / 3.0) + MQM * (t3 * t2 / 20.0);
  cov.block<3, 3>(0, 3) = q_a * (t2 / 2.0) + MQM * (t2 * t2 / 8.0);
  cov.block<3, 3>(0, 6) = MQ * (t3 / 6.0);
  cov.block<3, 3>(3, 3) = q_a * t + MQM * (t3 / 3.0);
  cov.block<3, 3>(3, 6) = MQ * (t2 / 2.0);
  cov.block<3, 3>(6, 6) = Q * t;
  cov.block<3, 3>(3, 0) = cov.block<3, 3>(0, 3).transpose();
  cov.block<3, 3>(6, 0) = cov.block<3, 3>(0, 6).transpose();
  cov.block<3, 3>(6, 3) = cov.block<3, 3>(3, 6).transpose();
  return cov;
}

// Gusts: a horizontal specific force in E, modelled as a Gauss-Markov process sampled at the ends
// of segments and linear between them. Gusts and a tilt of the AHRS change the path alike; drag and
// the accelerometer's x, y measure gusts only. What acts along the accelerometer's z is part of its
// reading, so only the rest of a gust adds to the motion. A vehicle leans into a gust g: were all
// of it added, the mean of the thrust would be off by about g^2 / gravity.

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
