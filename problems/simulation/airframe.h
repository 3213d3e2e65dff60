// The drone as a rigid body with rotors in moving air. Frames E (NED) and B (FRD at the centre of
// mass), SI.
#pragma once

#include <Eigen/Core>

#include "problems/simulation/blade_elements.h"
#include "problems/simulation/config.h"
#include "problems/simulation/effects.h"

namespace trueline::simulation {

inline constexpr int kMaxRotors = 8;
// Per rotor, without heap memory.
using RotorArray = Eigen::Array<double, Eigen::Dynamic, 1, 0, kMaxRotors, 1>;

struct BodyState {
  Vector3d p_E = Vector3d::Zero();
  Vector3d v_E = Vector3d::Zero();
  Eigen::Vector4d q_E_B = {0.0, 0.0, 0.0, 1.0};  // x, y, z, w as Eigen stores them
  Vector3d w_B = Vector3d::Zero();               // rad/s
  RotorArray rotors;                             // rad/s

  Quaterniond Attitude() const { return Quaterniond(q_E_B); }
};

// Time derivative of the state, and the forces that cause it.
struct BodyRate {
  BodyState rate;
  Vector3d f_B;   // m/s^2, specific force
  double thrust;  // m/s^2, specific thrust T, positive up
};

class Airframe {
 public:
  Airframe(const VehicleConfig& vehicle, double gravity, const Stages& stages);

  double motor_lag() const { return motor_lag_; }  // s, effects included
  // `command`: wanted rotor speeds (rad/s); `gust_E`: turbulence's specific force (m/s^2);
  // `twist_B`: its angular acceleration (rad/s^2).
  BodyRate Rate(double t, const BodyState& state, const RotorArray& command, const Vector3d& gust_E,
                const Vector3d& twist_B = Vector3d::Zero()) const;
  // One classical Runge-Kutta step of `dt` with command and gust held.
  BodyState Step(double t, double dt, const BodyState& state, const RotorArray& command,
                 const Vector3d& gust_E, const Vector3d& twist_B = Vector3d::Zero()) const;

 private:
  struct Wrench {
    Vector3d force_B = Vector3d::Zero();   // N
    Vector3d moment_B = Vector3d::Zero();  // N m, about the centre of mass
  };
  Wrench RotorWrench(const Flow& flow, const RotorArray& rotors, const Vector3d& com) const;
  // Of the rotors about their axes, N m s; of their accelerations its rate.
  Vector3d MomentumOf(const RotorArray& speeds) const;
  HubWrench HubWrenchOf(int rotor, const Flow& flow, double speed) const;

  VehicleConfig vehicle_;
  double gravity_;
  const Stages& stages_;
  std::vector<Vector3d> axes_B_;    // of thrust, effects included
  std::vector<BladeRotor> blades_;  // by rotor; empty: rotors in air at rest
  double motor_lag_;
};

}  // namespace trueline::simulation
