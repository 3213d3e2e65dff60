// The quadrotor model of Li et al. 2019, eq. 2-16: translation driven by the AHRS attitude and the
// thrust-axis acceleration, with linear drag, IMU misalignment, AHRS error and bias.
//
// Frames: E (NED earth), E' written Ep (the AHRS's erroneous earth), I (IMU), B (body).
#pragma once

#include <ceres/jet.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <string_view>

#include "cost_functions/models/rotation.h"

namespace trueline {

// What a parameter belongs to.
enum class ParameterGroup {
  kDrag,            // the airframe: constant
  kBias,            // the accelerometer: walks
  kAhrsError,       // the AHRS: walks, and drift adds to it
  kMisalignment,    // the airframe: constant
  kAttitudeFilter,  // errors of a known course over time (problems/vgd/attitude_errors.h):
                    // nuisances
};

// A normal prior with hard bounds.
struct ParameterPrior {
  double mean;
  double sigma;
  double lower;
  double upper;
};

struct ParameterInfo {
  const char* name;
  const char* unit;
  const char* meaning;  // in words, for a reader
  ParameterGroup group;
  ParameterPrior prior;  // in `unit`, angles in deg
};

// The parameters, in the order of theta: those of eq. 16; then b_ax and b_ay, which only the
// accelerometer's measurement of drag shows; then the attitude filter's errors, which no result
// states, in units of their sigmas. Mean and sigma are those of the uniform distributions
// over the ranges of Table 2 (sigma = width / sqrt(12)). Bounds are twice the ranges; drag may not
// be positive. The prior of b_ax and b_ay is an option of that measurement.
inline constexpr ParameterPrior kDragPrior{-0.5, 0.29, -2.0, 0.0};
inline constexpr ParameterPrior kAnglePrior{0.0, 1.73, -6.0, 6.0};
inline constexpr ParameterPrior kUnitPrior{0.0, 1.0, -std::numeric_limits<double>::infinity(),
                                           std::numeric_limits<double>::infinity()};
inline constexpr ParameterInfo kTheta[] = {
    {"K_x", "1/s", "linear drag along body x, by mass", ParameterGroup::kDrag, kDragPrior},
    {"K_y", "1/s", "linear drag along body y, by mass", ParameterGroup::kDrag, kDragPrior},
    {"b_az", "m/s^2", "accelerometer bias along z", ParameterGroup::kBias, {0.0, 0.58, -2.0, 2.0}},
    {"phi_E_Ep", "rad", "roll error of the AHRS", ParameterGroup::kAhrsError, kAnglePrior},
    {"theta_E_Ep", "rad", "pitch error of the AHRS", ParameterGroup::kAhrsError, kAnglePrior},
    {"psi_E_Ep", "rad", "heading error of the AHRS", ParameterGroup::kAhrsError, kAnglePrior},
    {"phi_I_B", "rad", "roll of the IMU in the body", ParameterGroup::kMisalignment, kAnglePrior},
    {"theta_I_B", "rad", "pitch of the IMU in the body", ParameterGroup::kMisalignment,
     kAnglePrior},
    {"psi_I_B", "rad", "heading of the IMU in the body", ParameterGroup::kMisalignment,
     kAnglePrior},
    {"b_ax", "m/s^2", "accelerometer bias along x", ParameterGroup::kBias, {}},
    {"b_ay", "m/s^2", "accelerometer bias along y", ParameterGroup::kBias, {}},
    {"filter_gyro_x", "1", "gyroscope bias in the AHRS, x", ParameterGroup::kAttitudeFilter,
     kUnitPrior},
    {"filter_gyro_y", "1", "gyroscope bias in the AHRS, y", ParameterGroup::kAttitudeFilter,
     kUnitPrior},
    {"filter_gyro_z", "1", "gyroscope bias in the AHRS, z", ParameterGroup::kAttitudeFilter,
     kUnitPrior},
    {"filter_gain", "1", "tilt by acceleration", ParameterGroup::kAttitudeFilter, kUnitPrior},
    {"filter_share", "1", "share of the tilt", ParameterGroup::kAttitudeFilter, kUnitPrior},
};

// The place of a parameter in theta.
consteval int InTheta(std::string_view name) {
  int i = 0;
  while (kTheta[i].name != name) ++i;
  return i;
}

inline constexpr int kThetaSize = static_cast<int>(std::size(kTheta));
inline constexpr int kDragInTheta = InTheta("K_x");        // K_x, K_y
inline constexpr int kAhrsInTheta = InTheta("phi_E_Ep");   // Phi_E_Ep
inline constexpr int kForceBiasInTheta = InTheta("b_ax");  // b_ax, b_ay
inline constexpr int kFilterInTheta = InTheta("filter_gyro_x");
inline constexpr int kFilterSize = kThetaSize - kFilterInTheta;
// Parameters that results state.
inline constexpr int kStatedSize = kFilterInTheta;
// Parameters of the equation of motion.
inline constexpr int kMotionSize = kForceBiasInTheta;

constexpr bool IsAirframe(int parameter) {
  const ParameterGroup group = kTheta[parameter].group;
  return group == ParameterGroup::kDrag || group == ParameterGroup::kMisalignment;
}
// The AHRS error belongs to a flight; the rest is the vehicle's.
constexpr bool IsVehicle(int parameter) {
  return parameter < kStatedSize && kTheta[parameter].group != ParameterGroup::kAhrsError;
}

// Derivatives by the parameters of the motion in their order and by the start's velocity in E.
using MotionJet = ceres::Jet<double, kMotionSize + 3>;

// The parameters of the equation of motion (eq. 16), constant over a window.
template <typename T>
struct ImuDrivenParameters {
  T K_x = T(0);                              // 1/s, drag along x_B; negative (eq. 9)
  T K_y = T(0);                              // 1/s, drag along y_B
  T b_az = T(0);                             // m/s^2; a_z = a_z measured - b_az (eq. 15)
  Vector3<T> Phi_E_Ep = Vector3<T>::Zero();  // rad, AHRS error (eq. 13)
  Vector3<T> Phi_I_B = Vector3<T>::Zero();   // rad, IMU misalignment (eq. 8)

  static ImuDrivenParameters FromArray(const T* theta) {
    const auto vector = [theta](int i) { return Vector3<T>(theta[i], theta[i + 1], theta[i + 2]); };
    ImuDrivenParameters p;
    p.K_x = theta[InTheta("K_x")];
    p.K_y = theta[InTheta("K_y")];
    p.b_az = theta[InTheta("b_az")];
    p.Phi_E_Ep = vector(InTheta("phi_E_Ep"));
    p.Phi_I_B = vector(InTheta("phi_I_B"));
    return p;
  }
};

// The input of the translation at one instant: the logged attitude and the thrust-axis
// acceleration. Plain numbers of the log, or power series of them for Lie derivatives.
template <typename D>
struct DriveOf {
  Matrix3<D> R_Ep_I;  // attitude as the AHRS estimates it
  D a_z;              // m/s^2, measured; -9.81 in hover
};
using Drive = DriveOf<double>;

// The axis along which a_z is the specific force. At 8 m/s a misalignment of 3 deg makes the
// accelerometer's z axis read 0.2 m/s^2 of drag, which the axis of the body would put into b_az.
enum class ThrustAxis {
  kBody,  // z_B, as eq. 15 takes it
  kImu,   // z_I, the accelerometer's own axis: thrust and a share of the drag
};

// For functions in which nearly all time is spent: compilers make a function call of each sum and
// product of Jets, unless they are told. Under the sanitizers they are not: with a check on every
// access the compilation would take half an hour.
#ifdef __SANITIZE_ADDRESS__
#define TRUELINE_INLINE inline
#define TRUELINE_FLATTEN inline
#else
#define TRUELINE_INLINE [[gnu::always_inline]] inline
#define TRUELINE_FLATTEN [[gnu::flatten]] inline
#endif

// m x, of plain numbers and any scalar (cheaper than casting the numbers to Jets).
template <typename M, typename X>
TRUELINE_INLINE auto Times(const M& m, const X& x) {
  Eigen::Matrix<decltype(m(0, 0) * x[0]), M::RowsAtCompileTime, 1> y;
  for (int i = 0; i < m.rows(); ++i) {
    y[i] = m(i, 0) * x[0];
    for (int j = 1; j < m.cols(); ++j) y[i] += m(i, j) * x[j];
  }
  return y;
}

// The model with its constant rotations precomputed.
template <typename T>
class ImuDrivenModel {
 public:
  // gravity in m/s^2.
  ImuDrivenModel(const ImuDrivenParameters<T>& parameters, double gravity,
                 ThrustAxis axis = ThrustAxis::kBody)
      : p_(parameters),
        axis_(axis),
        R_Ep_E_(RotationFromEuler<T>(parameters.Phi_E_Ep)),
        R_B_I_(RotationFromEuler<T>(parameters.Phi_I_B)),
        g_E_(T(0), T(0), T(gravity)) {}

  // R_E_B by eq. 14, which is written for the inverse: R_B_E = R_B_I R_I_Ep R_Ep_E.
  template <typename D>
  Matrix3<T> BodyToEarth(const Matrix3<D>& R_Ep_I) const {
    return R_Ep_E_.transpose() * R_Ep_I.template cast<T>() * R_B_I_.transpose();
  }

  // Specific force in B: linear drag (eq. 9-10), and along z what a_z shows: a_z less its bias (eq.
  // 15), or the z that solves the third row of R_I_B f_B = (..., a_z - b_az) (eq. 8).
  template <typename D>
  Vector3<T> SpecificForce(const D& a_z, const Vector3<T>& v_B) const {
    const T z = T(a_z) - p_.b_az;
    return Unseen(Vector3<T>(p_.K_x * v_B[0], p_.K_y * v_B[1], T(0))) +
           Vector3<T>(T(0), T(0), axis_ == ThrustAxis::kBody ? z : T(z / R_B_I_(2, 2)));
  }

  // The force in B of the given x and y that a_z does not show.
  Vector3<T> Unseen(const Vector3<T>& f_B) const {
    if (axis_ == ThrustAxis::kBody) return Vector3<T>(f_B[0], f_B[1], T(0));
    return Vector3<T>(f_B[0], f_B[1],
                      -(R_B_I_(0, 2) * f_B[0] + R_B_I_(1, 2) * f_B[1]) / R_B_I_(2, 2));
  }

  // The same turned to I, where v_I is given.
  Vector3<T> ForceInImu(double a_z, const Vector3<T>& v_I) const {
    return R_B_I_.transpose() * SpecificForce(a_z, R_B_I_ * v_I);
  }

  // dv_E/dt (eq. 6): gravity plus the specific force turned to E.
  Vector3<T> Acceleration(const Drive& drive, const Vector3<T>& v_E) const {
    return AccelerationBy(drive, v_E);
  }
  template <typename D>
  Vector3<T> AccelerationBy(const DriveOf<D>& drive, const Vector3<T>& v_E) const {
    const Matrix3<T> R_E_B = BodyToEarth(drive.R_Ep_I);
    return R_E_B * SpecificForce(drive.a_z, R_E_B.transpose() * v_E) + g_E_;
  }

  const ImuDrivenParameters<T>& parameters() const { return p_; }
  ThrustAxis axis() const { return axis_; }
  const Matrix3<T>& R_Ep_E() const { return R_Ep_E_; }
  const Matrix3<T>& R_B_I() const { return R_B_I_; }
  const Vector3<T>& g_E() const { return g_E_; }

 private:
  ImuDrivenParameters<T> p_;
  ThrustAxis axis_;
  Matrix3<T> R_Ep_E_;
  Matrix3<T> R_B_I_;
  Vector3<T> g_E_;
};

// Thrust-axis acceleration that holds the altitude, for vehicles without a usable accelerometer:
// a_z = -g / (cos phi cos theta), i.e. -g over the vertical component of z_I.
inline double LevelFlightThrust(const Eigen::Matrix3d& R_Ep_I, double gravity) {
  // Beyond 75 deg of tilt the assumption of level flight fails; the value is clamped there.
  constexpr double kMinCosTilt = 0.26;
  return -gravity / std::max(R_Ep_I(2, 2), kMinCosTilt);
}

}  // namespace trueline
