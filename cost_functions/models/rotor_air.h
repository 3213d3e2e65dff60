// Rotors one by one: thrust, drag and moments of each rotor from its own speed and the air speed of
// its own hub, v + w x r. Damping of body rates and the air's moment follow from the hubs; they are
// no terms of their own. Linear in the advance ratios of blade element theory (Leishman, Principles
// of Helicopter Aerodynamics, ch. 3 and 5; NeuroBEM, Bauersfeld et al. 2021, sec. III): with disc
// area A = pi R^2, tip speed u = omega R, hub velocity v, its part h across and v_z along the axis,
//   thrust      rho A (C_T u^2 - C_Tz u v_z + C_Th |h|^2 + C_Thy h_y^2)  along the axis; C_Thy: the
//               rotors ahead are nearer to those behind than left to right, and the body lifts
//   drag        rho A (C_H u + C_Hz v_z) (-h)                    at the hub (Faessler et al. 2018)
//   hub moment  rho A R (C_M u + C_Mz v_z) (v' x axis)           blades that flap back,
//                                                                uneven inflow
//   reaction    spin (rho A R C_Q u^2 + J_r domega/dt)           about the axis
//   body        -rho S_D |v| v / 2                               at the centre of mass
// v' follows the vehicle's velocity with the lag of the wake.
//
// Axes: body forward-left-up, the axis of all rotors is +z. That is the convention of the public
// data sets (problems/prediction), not the one of the calibration (forward-right-down).
#pragma once

#include <vector>

#include "cost_functions/models/rigid_body.h"

namespace trueline {

struct RotorAirInfo {
  const char* name;
  const char* unit;
  const char* about;
};

// The numbers of the model, in the order of RotorAir's constants.
inline constexpr RotorAirInfo kRotorAirNumbers[] = {
    {"C_T", "1", "thrust of a rotor at rest in the air"},
    {"C_Tz", "1", "thrust lost to air speed along the axis (inflow)"},
    {"C_Th", "1", "thrust gained by air speed across the axis (translational lift)"},
    {"C_Thy", "1", "what the latter has more for air speed from the side"},
    {"C_H", "1", "rotor drag across the axis"},
    {"C_Hz", "1", "rotor drag: change with air speed along the axis"},
    {"C_M", "1", "hub moment of air speed across the axis (flapping, uneven inflow)"},
    {"C_Mz", "1", "hub moment: change with air speed along the axis"},
    {"C_Q", "1", "reaction moment of a rotor's drag about its axis"},
    {"S_D", "m^2", "area of the body's quadratic drag"},
    {"S_Dz", "m^2", "what that area has more up and down"},
    {"J_r", "kg m^2", "inertia of a rotor about its axis"},
    {"I_x", "kg m^2", "inertia, roll"},
    {"I_y", "kg m^2", "inertia, pitch"},
    {"I_z", "kg m^2", "inertia, yaw"},
    {"r_x", "m", "centre of mass, forward"},
    {"r_y", "m", "centre of mass, left"},
    {"t_wake", "s", "lag of the hub moment behind the air speed"},
};

struct RotorAirVehicle {
  struct Rotor {
    Eigen::Vector3d position;  // m, of the hub from the origin of the body axes
    int spin = 1;              // sign of the reaction moment about +z
  };
  double mass = 0.0;         // kg
  double gravity = 9.81;     // m/s^2
  double radius = 0.0;       // m, of a rotor
  double air_density = 1.2;  // kg/m^3
  std::vector<Rotor> rotors;
};

// What a rotor does at one time.
struct RotorMotion {
  double speed = 0.0;         // rad/s
  double acceleration = 0.0;  // rad/s^2
};

template <class T>
struct RotorAirWrench {
  Vec3<T> force;   // N, without gravity
  Vec3<T> moment;  // N m, about the centre of mass
};

class RotorAir {
 public:
  enum Index : int {
    kThrust,
    kThrustInflow,
    kThrustLift,
    kThrustLiftAside,
    kDrag,
    kDragInflow,
    kMoment,
    kMomentInflow,
    kTorque,
    kBodyDrag,
    kBodyDragUp,
    kRotorInertia,
    kInertia,
    kCentre = kInertia + 3,
    kWakeLag = kCentre + 2,
    kCount
  };
  static_assert(kCount == std::size(kRotorAirNumbers));

  explicit RotorAir(RotorAirVehicle vehicle)
      : vehicle_(std::move(vehicle)),
        disc_(vehicle_.air_density * M_PI * vehicle_.radius * vehicle_.radius) {}

  const RotorAirVehicle& vehicle() const { return vehicle_; }

  // `c`: kCount numbers. `v`: velocity of the body's origin through the air, `wake`: the same, as
  // the wake lags behind it [m/s], `w`: body rate [rad/s]; all in body axes. `rotors`: one for
  // each.
  template <class T>
  RotorAirWrench<T> WrenchOn(const T* c, const Vec3<T>& v, const Vec3<T>& wake, const Vec3<T>& w,
                             const RotorMotion* rotors) const {
    RotorAirWrench<T> sum{BodyDrag(c, v), Zero<T>()};
    for (std::size_t i = 0; i < vehicle_.rotors.size(); ++i) {
      const RotorAirVehicle::Rotor& rotor = vehicle_.rotors[i];
      const Vec3<T> arm(T(rotor.position.x()) - c[kCentre], T(rotor.position.y()) - c[kCentre + 1],
                        T(rotor.position.z()));
      const Vec3<T> force = HubForce(c, Vec3<T>(v + Cross(w, arm)), rotors[i].speed);
      sum.force += force;
      sum.moment += Cross(arm, force) + HubMoment(c, wake, rotors[i].speed);
      sum.moment[2] += T(rotor.spin) * Reaction(c, rotors[i]);
    }
    return sum;
  }

  // Deceleration across the axis over air speed [1/s], of what is linear in it.
  template <class T>
  T LinearDrag(const T* c, const RotorMotion* rotors) const {
    double tips = 0.0;
    for (std::size_t i = 0; i < vehicle_.rotors.size(); ++i) {
      tips += rotors[i].speed * vehicle_.radius;
    }
    return c[kDrag] * T(disc_ * tips / vehicle_.mass);
  }

  // dw/dt [rad/s^2] of M = I dw/dt + w x I w.
  template <class T>
  static Vec3<T> AngularAcceleration(const T* c, const Vec3<T>& moment, const Vec3<T>& w) {
    const T* inertia = c + kInertia;
    const Vec3<T> momentum(inertia[0] * w[0], inertia[1] * w[1], inertia[2] * w[2]);
    const Vec3<T> torque = moment - Cross(w, momentum);
    return Vec3<T>(torque[0] / inertia[0], torque[1] / inertia[1], torque[2] / inertia[2]);
  }

 private:
  template <class T>
  static Vec3<T> Zero() {
    return Vec3<T>(T(0.0), T(0.0), T(0.0));
  }
  template <class T>
  Vec3<T> BodyDrag(const T* c, const Vec3<T>& v) const {
    using std::sqrt;
    const T speed = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + T(1e-12));
    const T factor = T(-0.5 * vehicle_.air_density) * c[kBodyDrag] * speed;
    const T up = T(-0.5 * vehicle_.air_density) * c[kBodyDragUp] * speed;
    return Vec3<T>(factor * v[0], factor * v[1], (factor + up) * v[2]);
  }
  template <class T>
  Vec3<T> HubForce(const T* c, const Vec3<T>& v, double speed) const {
    const double tip = speed * vehicle_.radius;
    const T lift = c[kThrustLift] * (v[0] * v[0] + v[1] * v[1]) + c[kThrustLiftAside] * v[1] * v[1];
    const T drag = T(-disc_) * (c[kDrag] * T(tip) + c[kDragInflow] * v[2]);
    const T thrust =
        T(disc_) * (c[kThrust] * T(tip * tip) - c[kThrustInflow] * T(tip) * v[2] + lift);
    return Vec3<T>(drag * v[0], drag * v[1], thrust);
  }
  template <class T>
  Vec3<T> HubMoment(const T* c, const Vec3<T>& v, double speed) const {
    const T factor = T(disc_ * vehicle_.radius) *
                     (c[kMoment] * T(speed * vehicle_.radius) + c[kMomentInflow] * v[2]);
    return Vec3<T>(factor * v[1], -factor * v[0], T(0.0));
  }
  template <class T>
  T Reaction(const T* c, const RotorMotion& rotor) const {
    const double tip = rotor.speed * vehicle_.radius;
    return c[kTorque] * T(disc_ * vehicle_.radius * tip * tip) +
           c[kRotorInertia] * T(rotor.acceleration);
  }

  RotorAirVehicle vehicle_;
  double disc_;  // kg/m, air density times disc area
};

}  // namespace trueline
