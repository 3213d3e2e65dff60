// The simulator's own rotations, on Eigen's types: the check of the estimators' model must not
// share its code.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace trueline::simulation {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// The rotation by yaw, then pitch, then roll (z-y-x), from the rotated frame to the first frame.
// `euler` is (phi, theta, psi) in rad.
inline Quaterniond TurnedBy(const Vector3d& euler) {
  return Eigen::AngleAxisd(euler.z(), Vector3d::UnitZ()) *
         Eigen::AngleAxisd(euler.y(), Vector3d::UnitY()) *
         Eigen::AngleAxisd(euler.x(), Vector3d::UnitX());
}

// R(Phi) of Li et al. 2019, eq. 1: takes a vector of the first frame to the second, so the angles
// Phi_E^E' give the rotation q_Ep_E.
inline Quaterniond FrameChange(const Vector3d& euler) { return TurnedBy(euler).conjugate(); }

// The angles (phi, theta, psi) in rad of a matrix of eq. 1; theta within +-pi/2.
inline Vector3d EulerOf(const Quaterniond& frame_change) {
  const Eigen::Matrix3d m = frame_change.toRotationMatrix();
  return {std::atan2(m(1, 2), m(2, 2)), -std::asin(std::clamp(m(0, 2), -1.0, 1.0)),
          std::atan2(m(0, 1), m(0, 0))};
}

// Heading psi (rad) of a body, from the rotation that takes body vectors to earth.
inline double HeadingOf(const Quaterniond& q_E_B) {
  const Vector3d forward_E = q_E_B * Vector3d::UnitX();
  return std::atan2(forward_E.y(), forward_E.x());
}

inline double WrapAngle(double angle) { return std::remainder(angle, 2.0 * M_PI); }

// The rotation by the vector `angle` (rad), exact for any size.
inline Quaterniond RotationByVector(const Vector3d& angle) {
  const double norm = angle.norm();
  if (norm < 1e-12) return Quaterniond(1.0, 0.5 * angle.x(), 0.5 * angle.y(), 0.5 * angle.z());
  return Quaterniond(Eigen::AngleAxisd(norm, angle / norm));
}

// The shortest turn that takes the direction of `a` to that of `b`, which are not opposite.
// (Eigen's FromTwoVectors compiles a singular value decomposition for opposite ones.)
inline Quaterniond TurnBetween(const Vector3d& a, const Vector3d& b) {
  const Vector3d u = a.normalized(), v = b.normalized(), axis = u.cross(v);
  return Quaterniond(1.0 + u.dot(v), axis.x(), axis.y(), axis.z()).normalized();
}

// R_E_B as a quaternion: -z_B along the wanted `thrust_E`, x_B towards `heading` (rad).
inline Quaterniond AttitudeFor(const Vector3d& thrust_E, double heading) {
  const Vector3d z = -thrust_E.normalized();
  const Vector3d y = z.cross(Vector3d(std::cos(heading), std::sin(heading), 0.0)).normalized();
  Eigen::Matrix3d R_E_B;
  R_E_B << y.cross(z), y, z;
  return Quaterniond(R_E_B);
}

// Twice the vector part, on the shorter way: the rotation vector (rad) of a small or moderate turn.
inline Vector3d SmallTurn(const Quaterniond& q) { return (q.w() < 0.0 ? -2.0 : 2.0) * q.vec(); }

}  // namespace trueline::simulation
