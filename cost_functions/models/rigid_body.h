// Rigid-body mechanics in polynomial form, for evaluation in any scalar (double, Jets, truncated
// Taylor series, numbers modulo a prime). Quaternions are (w, x, y, z).
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace trueline {

template <class T>
using Vec3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Vec4 = Eigen::Matrix<T, 4, 1>;

// Hamilton's product a * b.
template <class T>
Vec4<T> HamiltonProduct(const Vec4<T>& a, const Vec4<T>& b) {
  return Vec4<T>(a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                 a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                 a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                 a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]);
}

template <class T>
Vec4<T> Conjugate(const Vec4<T>& q) {
  return Vec4<T>(q[0], -q[1], -q[2], -q[3]);
}

// q * (0, w): twice the rate of q under the body rate w [rad/s].
template <class T>
Vec4<T> TimesPure(const Vec4<T>& q, const Vec3<T>& w) {
  return Vec4<T>(-q[1] * w[0] - q[2] * w[1] - q[3] * w[2], q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
                 q[0] * w[1] - q[1] * w[2] + q[3] * w[0], q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);
}

template <class T>
Vec3<T> Cross(const Vec3<T>& a, const Vec3<T>& b) {
  return Vec3<T>(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
}

template <class T>
Vec3<T> Scaled(const T& factor, const Vec3<T>& v) {
  return Vec3<T>(factor * v[0], factor * v[1], factor * v[2]);
}

// Each component by its own factor, as a diagonal matrix multiplies: `factors`, 3 numbers.
template <class T>
Vec3<T> ScaledBy(const T* factors, const Vec3<T>& v) {
  return Vec3<T>(factors[0] * v[0], factors[1] * v[1], factors[2] * v[2]);
}

// R(q) v for |q| = 1, as v + 2 u x (u x v + w v) with q = (w, u).
template <class T>
Vec3<T> RotateByUnit(const Vec4<T>& q, const Vec3<T>& v) {
  const Vec3<T> u(q[1], q[2], q[3]);
  const Vec3<T> inner = Cross(u, v) + Scaled(T(q[0]), v);
  const Vec3<T> turn = Cross(u, inner);
  return v + (turn + turn);
}

// Diagonal inertia [kg m^2] of a body whose second moments of mass about the three planes are
// exp(log_s) [kg m^2]: J = tr(S) I - S. A chart for estimators: every real log_s gives a physical
// inertia (positive, within the triangle inequality), and every physical inertia has one log_s.
template <class T>
Vec3<T> InertiaFromLogSecondMoments(const Vec3<T>& log_s) {
  using std::exp;
  const Vec3<T> s(exp(log_s[0]), exp(log_s[1]), exp(log_s[2]));
  return Vec3<T>(s[1] + s[2], s[2] + s[0], s[0] + s[1]);
}

// Positive, and each moment below the sum of the other two.
inline bool IsPhysicalInertia(const Eigen::Vector3d& inertia) {
  const double half_trace = 0.5 * inertia.sum();
  return (inertia.array() > 0.0).all() && (inertia.array() < half_trace).all();
}

// One rotor: thrust k_f u along `axis`, reaction moment spin k_m u along `axis`, u the squared
// speed. A rotor that turns clockwise seen from above (spin +1) turns the body anticlockwise: a
// moment along its upward axis.
struct Rotor {
  Eigen::Vector3d position;              // m, in B
  Eigen::Vector3d axis{0.0, 0.0, -1.0};  // unit vector of thrust, in B
  int spin = 1;                          // +1 clockwise seen from above
  double k_f = 0.0;                      // N s^2
  double k_m = 0.0;                      // N m s^2
};

}  // namespace trueline
