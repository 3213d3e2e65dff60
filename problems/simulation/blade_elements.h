// A rotor by blade elements, for flights in air that the estimators' models do not know. Each blade
// is cut along its span and followed once round. Its elements meet the hub's air speed, the flow
// that momentum theory induces, and the flapping of a stiff blade (Leishman, Principles of
// Helicopter Aerodynamics, ch. 2.14, 3.5 and 4.5). Drag, inflow, lift, hub moments and the damping
// of turn rates follow from these; none of them is stated.
#pragma once

#include "problems/simulation/config.h"

namespace trueline::simulation {

struct HubMotion {
  Vector3d v_B;  // m/s, of the hub through the air
  Vector3d w_B;  // rad/s, of the body
  double speed;  // rad/s, of the rotor, above 0
};

struct HubWrench {
  Vector3d force_B = Vector3d::Zero();   // N
  Vector3d moment_B = Vector3d::Zero();  // N m, about the hub
};

class BladeRotor {
 public:
  // Pitch and profile drag of the blades are such that the rotor has its k_f and k_m at rest in the
  // air. Throws InputError if no blade of this shape does.
  BladeRotor(const BladeConfig& blades, const Rotor& rotor);

  HubWrench WrenchOn(const HubMotion& hub) const;

  double pitch() const { return pitch_; }                // rad, at three quarters of the radius
  double profile_drag() const { return profile_drag_; }  // coefficient of a section

 private:
  struct Wind;
  struct Response;
  struct Loads {
    Vector3d force = Vector3d::Zero();  // N, in the disc's axes
    double torque = 0.0;                // N m, that holds the blades back
  };

  template <class Visit>
  void ForEachElement(const Wind& wind, const Visit& visit) const;
  Response Settled(const Wind& wind) const;
  Response SettledAt(const Wind& wind, double skew) const;
  double InducedBy(double thrust, double slope, const Wind& wind) const;
  Loads LoadsOn(const Wind& wind, const Response& response) const;

  BladeConfig blades_;
  Vector3d axis_B_;
  int turns_;                             // +1: about the axis, -1: against it
  double disc_;                           // kg/m, air density times area
  double flap_inertia_, flap_stiffness_;  // kg m^2, N m, of one blade
  double pitch_ = 0.0, profile_drag_ = 0.0;
};

}  // namespace trueline::simulation
