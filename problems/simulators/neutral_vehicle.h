// A rotor-driven vehicle as simulators state it, in Trueline's frames and units: B is
// forward-right-down, spin +1 clockwise seen from above. Only what a file, or a model, states is
// there.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/calibration/rotor_calibration.h"

namespace trueline {

struct NeutralInfo {
  const char* name;
  const char* unit;
  const char* meaning;
  // A flight by rotor speeds says more of it where this is flown, and what `needs` names is in the
  // log. Neither: see the audit.
  const char* fly = "";
  unsigned needs = 0;
};
// Bits of NeutralInfo::needs: measured rotor speeds, motor commands, the weighed mass.
inline constexpr unsigned kNeedsSpeeds = 1, kNeedsCommands = 2, kNeedsMass = 4;

// The parameters that files, models and flights are compared by.
inline constexpr NeutralInfo kNeutral[] = {
    {"m", "kg", "mass", "", kNeedsMass},
    {"I_x", "kg m^2", "moment of inertia about body x", "roll hard to both sides, and stop"},
    {"I_y", "kg m^2", "moment of inertia about body y", "pitch hard to both sides, and stop"},
    {"I_z", "kg m^2", "moment of inertia about body z", "yaw hard to both sides, and stop"},
    {"r_BM_x", "m", "centre of mass along x", "hover", kNeedsSpeeds},
    {"r_BM_y", "m", "centre of mass along y", "hover", kNeedsSpeeds},
    {"r_BM_z", "m", "centre of mass along z", "roll and pitch hard at speed"},
    {"k_f", "N s^2", "thrust over the square of the rotor's speed", "", kNeedsSpeeds | kNeedsMass},
    {"k_m", "N m s^2", "reaction moment over the square of the rotor's speed",
     "yaw hard to both sides, and stop", kNeedsSpeeds},
    {"tau", "s", "lag of a rotor behind its command", "change thrust quickly",
     kNeedsSpeeds | kNeedsCommands},
    {"full_speed", "rad/s", "rotor speed at full command", "change thrust from hover to full",
     kNeedsSpeeds | kNeedsCommands},
    {"K_x", "1/s", "linear drag along body x, by mass", "fly forwards and back at several speeds"},
    {"K_y", "1/s", "linear drag along body y, by mass", "fly sideways at several speeds"},
    {"K_z", "1/s", "linear drag along body z, by mass", "climb and descend at several speeds"},
    {"rotor_speed_drag", "1", "drag by rotor speed and air speed, by mass"},
    {"rotor_inflow", "1", "thrust lost in a climb, by rotor speed and mass"},
    {"translational_lift", "1/m", "thrust gained by horizontal air speed, by mass"},
    {"c_x", "1/m", "quadratic drag along body x, by mass", "fly forwards slowly and fast"},
    {"c_y", "1/m", "quadratic drag along body y, by mass", "fly sideways slowly and fast"},
    {"c_z", "1/m", "quadratic drag along body z, by mass", "climb slowly and fast"},
    {"ground_effect", "m", "height scale of the ground effect", "hover low and high"},
    {"air_moment", "N s", "moment of the air by speed, roll and pitch"},
    // What logs alone are compared by, too.
    {"K_xy", "1/s", "force along body x by air speed along y, by mass"},
    {"K_yx", "1/s", "force along body y by air speed along x, by mass"},
    {"K_twice", "1/s", "force by air speed that is turned into the body once too often, by mass"},
    {"L_p", "1/s", "roll acceleration by roll rate (damping: negative)"},
    {"M_q", "1/s", "pitch acceleration by pitch rate (damping: negative)"},
    {"N_r", "1/s", "yaw acceleration by yaw rate (damping: negative)"},
    {"L_u", "rad/m/s", "roll acceleration by air speed along x"},
    {"L_v", "rad/m/s", "roll acceleration by air speed along y"},
    {"M_u", "rad/m/s", "pitch acceleration by air speed along x"},
    {"M_v", "rad/m/s", "pitch acceleration by air speed along y"},
    {"J_r_roll", "kg m^2", "inertia of a rotor, as roll by pitch rate shows it"},
    {"J_r_pitch", "kg m^2", "inertia of a rotor, as pitch by roll rate shows it"},
    {"J_r_yaw", "kg m^2",
     "inertia of a rotor, as yaw by changes of speed shows it: a moment that "
     "leads the thrust looks like it"},
};
// Null for a name that is only a file's (arm, lever, ...).
const NeutralInfo* FindNeutral(const std::string& name);

using Numbers = std::map<std::string, double>;

// A number of the whole vehicle or, with `rotor` from 0, of a rotor (x, y, z [m, in B], spin, k_f,
// k_m). Derived names can be got and, where that has a meaning, set: x_M, y_M, z_M (rotor from the
// centre of mass), k_f and k_m of all rotors (mean), arm (mean distance of the rotors from the
// centre of mass, m), lever, lever_x, lever_y (the same along both, or one, of the axes), radius
// and angle of a rotor, spin_k_m (spin times k_m), K and c (of all axes), body_mass (without rotors
// of raw_rotor_mass each), box_x, box_y, box_z (SideOfBox), small_... (1, which a unit scales), n
// (rotors), w_h and S_h (speed of a rotor and of all in hover, rad/s). Of a flight S_h is its mean,
// and v_m (m/s) the air speed at which quadratic drag acts as linear drag does.
class NeutralVehicle {
 public:
  std::string name;
  double gravity = 9.81;  // m/s^2
  Numbers body;
  std::vector<Numbers> rotors;

  bool States(const std::string& number) const { return body.contains(number); }
  double Get(const std::string& number, int rotor = -1) const;
  void Set(const std::string& number, int rotor, double value);
  // kg m^2, of motors of raw_motor_mass each in the rotors' places, about an axis (0 to 2).
  double InertiaOfMotors(int axis) const;
  // m, of a box along an axis that has the rest of the mass and of the inertia.
  double SideOfBox(int axis) const;
  // m, the centre of mass from the middle of the rotors, along an axis (0 to 2): files have origins
  // of their own.
  double CentreFromRotors(int axis) const;
  // True where rotors have places, spins and k_f, and the body mass and inertia.
  bool Flies() const;
};

// What a model.yaml of a calibration or diagnosis with --drive=rotors states.
struct RotorModelFile {
  RotorConstants constants = RotorConstants::Zero();
  std::vector<Rotor> rotors;  // k_f and k_m nominal: the constants scale them
  std::vector<Effect> effects;
  double full_speed = 0.0;  // rad/s, of its motors; 0 where rotor speeds were measured
};
// Throws InputError for one of the other drive.
RotorModelFile ReadRotorModel(const std::string& file);

// The vehicle of a model.yaml that a calibration or diagnosis with --drive=rotors has written.
// Throws InputError for one of the other drive.
NeutralVehicle VehicleFromModel(const std::string& file);

// The effects, in the catalogue's units, and the constants that make the vehicle fly.
std::vector<Effect> EffectsOf(const NeutralVehicle& vehicle);
RotorVehicle RotorVehicleOf(const NeutralVehicle& vehicle);

}  // namespace trueline
