// The quadrotor model of Li et al. 2019, eq. 2-16: translation driven by the AHRS attitude and the
// thrust-axis acceleration, with linear drag, IMU misalignment, AHRS error and bias.
//
// Frames: E (NED earth), E' written Ep (the AHRS's erroneous earth), I (IMU), B (body).
#pragma once

#include <algorithm>
#include <array>

#include "cost_functions/models/rotation.h"

namespace trueline {

// The nine unknowns of eq. 16, constant over a window.
template <typename T>
struct ImuDrivenParameters {
  static constexpr int kSize = 9;

  T K_x = T(0);                              // 1/s, drag along x_B; negative (eq. 9)
  T K_y = T(0);                              // 1/s, drag along y_B
  T b_az = T(0);                             // m/s^2; a_z = a_z measured - b_az (eq. 15)
  Vector3<T> Phi_E_Ep = Vector3<T>::Zero();  // rad, AHRS error (eq. 13)
  Vector3<T> Phi_I_B = Vector3<T>::Zero();   // rad, IMU misalignment (eq. 8)

  static ImuDrivenParameters FromArray(const T* theta) {
    ImuDrivenParameters p;
    p.K_x = theta[0];
    p.K_y = theta[1];
    p.b_az = theta[2];
    p.Phi_E_Ep = Vector3<T>(theta[3], theta[4], theta[5]);
    p.Phi_I_B = Vector3<T>(theta[6], theta[7], theta[8]);
    return p;
  }
};

// Names and units in the order of FromArray, as results use them.
inline constexpr std::array<const char*, 9> kImuDrivenNames = {
    "K_x", "K_y", "b_az", "phi_E_Ep", "theta_E_Ep", "psi_E_Ep", "phi_I_B", "theta_I_B", "psi_I_B"};
inline constexpr std::array<const char*, 9> kImuDrivenUnits = {"1/s", "1/s", "m/s^2", "rad", "rad",
                                                               "rad", "rad", "rad",   "rad"};

// The input of the translation at one instant: the logged attitude and the thrust-axis
// acceleration. Plain numbers of the log, or power series of them for Lie derivatives.
template <typename D>
struct DriveOf {
  Matrix3<D> R_Ep_I;  // attitude as the AHRS estimates it
  D a_z;              // m/s^2, measured along the thrust axis; -9.81 in hover
};
using Drive = DriveOf<double>;

// The model with its constant rotations precomputed.
template <typename T>
class ImuDrivenModel {
 public:
  // gravity in m/s^2.
  ImuDrivenModel(const ImuDrivenParameters<T>& parameters, double gravity)
      : p_(parameters),
        R_Ep_E_(RotationFromEuler<T>(parameters.Phi_E_Ep)),
        R_B_I_(RotationFromEuler<T>(parameters.Phi_I_B)),
        g_E_(T(0), T(0), T(gravity)) {}

  // R_E_B by eq. 14, which is written for the inverse: R_B_E = R_B_I R_I_Ep R_Ep_E.
  template <typename D>
  Matrix3<T> BodyToEarth(const Matrix3<D>& R_Ep_I) const {
    return R_Ep_E_.transpose() * R_Ep_I.template cast<T>() * R_B_I_.transpose();
  }

  // Specific force in B: linear drag (eq. 9-10), and along z the thrust-axis acceleration less its
  // bias.
  template <typename D>
  Vector3<T> SpecificForce(const D& a_z, const Vector3<T>& v_B) const {
    return Vector3<T>(p_.K_x * v_B[0], p_.K_y * v_B[1], T(a_z) - p_.b_az);
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
  const Matrix3<T>& R_Ep_E() const { return R_Ep_E_; }
  const Matrix3<T>& R_B_I() const { return R_B_I_; }
  const Vector3<T>& g_E() const { return g_E_; }

 private:
  ImuDrivenParameters<T> p_;
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
