// The complementary attitude filter of Li et al. 2019, fig. 3: gyroscopes are integrated; the
// accelerometer's tilt (eq. 12) feeds back proportionally and through an integral that estimates
// the gyro bias. On quaternions, so no attitude is singular.
#pragma once

#include "cost_functions/models/rotation.h"

namespace trueline {

struct ComplementaryFilterGains {
  double k_p = 0.1;    // 1/s, proportional: tilt error decays with 1 / k_p
  double k_i = 0.005;  // 1/s^2, integral: estimates the gyro bias
};

// The filter mistakes kinematic acceleration for gravity, as the paper's AHRS does: its tilt error
// under acceleration is about k_p (v - mean v) / g. Its heading is that of the gyro alone.
template <typename T>
class ComplementaryFilter {
 public:
  ComplementaryFilter(const ComplementaryFilterGains& gains, const Eigen::Quaternion<T>& q_Ep_I)
      : gains_(gains), q_Ep_I_(q_Ep_I) {}

  // Attitude of a vehicle at rest from its accelerometer (eq. 12), with heading psi (rad).
  static Eigen::Quaternion<T> LevelFrom(const Vector3<T>& f_I, const T& psi) {
    using std::atan2;
    using std::sqrt;
    const T phi = atan2(-f_I[1], -f_I[2]);
    const T theta = atan2(f_I[0], sqrt(f_I[1] * f_I[1] + f_I[2] * f_I[2]));
    return QuaternionFromEuler<T>(Vector3<T>(phi, theta, psi));
  }

  // One step of dt seconds with gyro (rad/s) and specific force (m/s^2) in I.
  void Step(const Vector3<T>& gyro, const Vector3<T>& f_I, double dt) {
    const Vector3<T> error = TiltError(f_I, q_Ep_I_);
    const Vector3<T> rate = gyro - bias_ + error * T(gains_.k_p);
    bias_ -= error * T(gains_.k_i * dt);
    q_Ep_I_ = (q_Ep_I_ * SmallRotation(rate * T(dt))).normalized();
  }

  const Eigen::Quaternion<T>& q_Ep_I() const { return q_Ep_I_; }
  const Vector3<T>& gyro_bias() const { return bias_; }

  // Rotation vector in I (rad, small angles) that aligns the estimate's "up" with the measured
  // specific force; zero in free fall, where the direction is undefined.
  static Vector3<T> TiltError(const Vector3<T>& f_I, const Eigen::Quaternion<T>& q_Ep_I) {
    const T norm = f_I.norm();
    if (norm < T(1.0)) return Vector3<T>::Zero();
    const Vector3<T> up_I = q_Ep_I.conjugate() * Vector3<T>(T(0), T(0), T(-1));
    return (f_I / norm).cross(up_I);
  }

 private:
  static Eigen::Quaternion<T> SmallRotation(const Vector3<T>& angle) {
    const Vector3<T> half = angle * T(0.5);  // second-order accurate once normalised
    return Eigen::Quaternion<T>(T(1) - half.squaredNorm() * T(0.5), half[0], half[1], half[2]);
  }

  ComplementaryFilterGains gains_;
  Eigen::Quaternion<T> q_Ep_I_;
  Vector3<T> bias_ = Vector3<T>::Zero();
};

}  // namespace trueline
