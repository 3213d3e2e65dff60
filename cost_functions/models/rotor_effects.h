// Effects on a rotor-driven vehicle beyond RotorDrivenModel, off by default. With v_B the velocity
// in body axes [m/s] and t the time since the flight's first sample:
//   thrust sag          k_f is multiplied by 1 - d t
//   rotor loss          one rotor's k_f is multiplied by a factor; its reaction moment is not
//   rotor speed drag    f_xy += -k sum(omega) v_xy
//   translational lift  f_z += -k (v_x^2 + v_y^2)
//   ground effect       thrust is multiplied by 1 / (1 - (k / h)^2), h the height above p_z = 0
//   air moment          M_x += -roll v_y, M_y += pitch v_x (body axes, about the centre of mass):
//                       drag that acts above it, and blades that flap back in the wind of flight
//   payload, com step   mass and its centre change once
//   rotor tilt          all rotors' axes are turned by roll and pitch
#pragma once

#include <Eigen/Geometry>
#include <algorithm>

#include "cost_functions/models/rigid_body.h"

namespace trueline {

struct RotorEffects {
  double thrust_sag = 0.0;        // d, 1/s
  int weak_rotor = -1;            // index, -1 for none
  double weak_factor = 1.0;       // 1
  double speed_drag = 0.0;        // k, 1
  double lift = 0.0;              // k, 1/m
  double ground = 0.0;            // k, m
  double moment_roll = 0.0;       // N s
  double moment_pitch = 0.0;      // N s
  double payload = 0.0;           // kg
  double payload_time = 0.0;      // s
  Eigen::Vector2d com{0.0, 0.0};  // dx, dy, m
  double com_time = 0.0;          // s
  double tilt_roll = 0.0;         // rad
  double tilt_pitch = 0.0;        // rad

  // The factor on a rotor's thrust, without the ground effect.
  double ThrustFactor(int rotor, double t) const {
    return (1.0 - thrust_sag * t) * (rotor == weak_rotor ? weak_factor : 1.0);
  }
  // Rotation from rotor axes as built to the actual ones.
  Eigen::Matrix3d Tilt() const {
    return (Eigen::AngleAxisd(tilt_pitch, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(tilt_roll, Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
  }
  double AddedMass(double t) const { return t >= payload_time ? payload : 0.0; }
  // Displacement of the centre of mass from its place as built, m.
  Eigen::Vector3d CentreShift(double t) const {
    return t >= com_time ? Eigen::Vector3d(com.x(), com.y(), 0.0) : Eigen::Vector3d::Zero();
  }
  // The formula of Cheeseman and Bennett is valid down to about one radius: (k / h)^2 is clamped to
  // 0.81, also at and below the floor.
  template <class T>
  T GroundFactor(const T& height) const {
    constexpr double kMost = 0.81;
    if (ground == 0.0) return T(1.0);
    if (height < T(ground / 0.9)) return T(1.0 / (1.0 - kMost));
    return T(1.0) / (T(1.0) - T(ground * ground) / (height * height));
  }
  // Specific force of the air on the rotors beyond thrust, in body axes.
  template <class T>
  Vec3<T> AirForce(const Vec3<T>& v_B, double speed_sum) const {
    const T drag(-speed_drag * speed_sum);
    return Vec3<T>(drag * v_B[0], drag * v_B[1], T(-lift) * (v_B[0] * v_B[0] + v_B[1] * v_B[1]));
  }
  // Moment of the air about the centre of mass beyond that of thrust, N m, in body axes.
  template <class T>
  Vec3<T> AirMoment(const Vec3<T>& v_B) const {
    return Vec3<T>(T(-moment_roll) * v_B[1], T(moment_pitch) * v_B[0], T(0.0));
  }
};

}  // namespace trueline
