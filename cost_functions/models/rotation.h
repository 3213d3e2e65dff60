// Rotations in the paper's z-y-x Euler angles, and their quaternion form.
//
// Names: R_A_B takes a vector in B to A; Phi_A_B = (phi, theta, psi) are the angles of the three
// successive rotations (z, then y, then x) that turn frame A into frame B, in radians.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace trueline {

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

// R_B_A from Phi_A_B: takes a vector in A to B (Li et al. 2019, eq. 1, there written R_A^B).
template <typename T>
Matrix3<T> RotationFromEuler(const Vector3<T>& Phi_A_B) {
  using std::cos;
  using std::sin;
  const T s_phi = sin(Phi_A_B[0]), c_phi = cos(Phi_A_B[0]);
  const T s_theta = sin(Phi_A_B[1]), c_theta = cos(Phi_A_B[1]);
  const T s_psi = sin(Phi_A_B[2]), c_psi = cos(Phi_A_B[2]);
  Matrix3<T> R_B_A;
  R_B_A << c_theta * c_psi, c_theta * s_psi, -s_theta,  //
      s_phi * s_theta * c_psi - c_phi * s_psi, s_phi * s_theta * s_psi + c_phi * c_psi,
      s_phi * c_theta,  //
      c_phi * s_theta * c_psi + s_phi * s_psi, c_phi * s_theta * s_psi - s_phi * c_psi,
      c_phi * c_theta;
  return R_B_A;
}

// psi of R_E_B, rad: the direction of x_B over the ground.
inline double Heading(const Eigen::Matrix3d& R_E_B) { return std::atan2(R_E_B(1, 0), R_E_B(0, 0)); }

// q_A_B from Phi_A_B: the Hamilton quaternion that takes a vector in B to A, i.e. the transpose of
// RotationFromEuler.
template <typename T>
Eigen::Quaternion<T> QuaternionFromEuler(const Vector3<T>& Phi_A_B) {
  using std::cos;
  using std::sin;
  const Vector3<T> half = Phi_A_B * T(0.5);
  const T s_phi = sin(half[0]), c_phi = cos(half[0]);
  const T s_theta = sin(half[1]), c_theta = cos(half[1]);
  const T s_psi = sin(half[2]), c_psi = cos(half[2]);
  return Eigen::Quaternion<T>(c_phi * c_theta * c_psi + s_phi * s_theta * s_psi,
                              s_phi * c_theta * c_psi - c_phi * s_theta * s_psi,
                              c_phi * s_theta * c_psi + s_phi * c_theta * s_psi,
                              c_phi * c_theta * s_psi - s_phi * s_theta * c_psi);
}

// Phi_A_B from R_B_A; theta in [-pi/2, pi/2]. At theta = +-pi/2 phi and psi are not unique.
template <typename T>
Vector3<T> EulerFromRotation(const Matrix3<T>& R_B_A) {
  using std::asin;
  using std::atan2;
  const T s_theta = -R_B_A(0, 2);
  const T clamped = s_theta > T(1) ? T(1) : (s_theta < T(-1) ? T(-1) : s_theta);
  return Vector3<T>(atan2(R_B_A(1, 2), R_B_A(2, 2)), asin(clamped),
                    atan2(R_B_A(0, 1), R_B_A(0, 0)));
}

template <typename T>
Vector3<T> EulerFromQuaternion(const Eigen::Quaternion<T>& q_A_B) {
  return EulerFromRotation<T>(q_A_B.toRotationMatrix().transpose());
}

// The rotation vector (rad) of the shorter way.
inline Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd turn(q);
  return turn.angle() * turn.axis();
}

// The rotation by a vector (rad); the identity for zero. Series serve small angles, as between
// samples of a gyroscope, to the last digit.
inline Eigen::Quaterniond RotationByVector(const Eigen::Vector3d& v) {
  constexpr double kSmall = 1e-3;  // square of half the angle
  const double h = 0.25 * v.squaredNorm();
  if (h < kSmall) {
    const Eigen::Vector3d axis = 0.5 * (1.0 - h / 6.0 * (1.0 - h / 20.0 * (1.0 - h / 42.0))) * v;
    const double w = 1.0 - h / 2.0 * (1.0 - h / 12.0 * (1.0 - h / 30.0 * (1.0 - h / 56.0)));
    return Eigen::Quaterniond(w, axis.x(), axis.y(), axis.z());
  }
  return Eigen::Quaterniond(Eigen::AngleAxisd(v.norm(), v.stableNormalized()));
}

// Takes body rates (p, q, r) to Euler angle rates (eq. 11, with -sin(phi) in the middle row, where
// the paper prints -sin(theta)). Singular at theta = +-pi/2.
template <typename T>
Matrix3<T> EulerRateFromBodyRate(const Vector3<T>& Phi) {
  using std::cos;
  using std::sin;
  using std::tan;
  const T s_phi = sin(Phi[0]), c_phi = cos(Phi[0]), c_theta = cos(Phi[1]), t_theta = tan(Phi[1]);
  Matrix3<T> R;
  R << T(1), t_theta * s_phi, t_theta * c_phi,  //
      T(0), c_phi, -s_phi,                      //
      T(0), s_phi / c_theta, c_phi / c_theta;
  return R;
}

// [v]x, so that Skew(v) * w = v.cross(w).
template <typename T>
Matrix3<T> Skew(const Vector3<T>& v) {
  Matrix3<T> S;
  S << T(0), -v[2], v[1], v[2], T(0), -v[0], -v[1], v[0], T(0);
  return S;
}

}  // namespace trueline
