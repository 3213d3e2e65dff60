// The constants of the rotor-driven model, in the order of its state (RotorAeroModel::Index):
// names, units, and default priors.
#pragma once

#include <iterator>
#include <string_view>

namespace trueline {

// What a constant enters.
enum class RotorConstantGroup {
  kMotion,    // force or moment, hence motion and accelerometer
  kImuArm,    // the accelerometer alone
  kPose,      // poses
  kBias,      // of the IMU
  kCommands,  // rotor speeds, where they come from commands
};

struct RotorConstantInfo {
  const char* name;
  const char* unit;
  const char* meaning;  // in words, for a reader
  RotorConstantGroup group;
  double typical;         // a typical change, which scales numerical ranks
  double sigma = 0.0;     // of the default prior, for a new payload; zero: known
  bool relative = false;  // sigma is a share of the nominal value
};

inline constexpr RotorConstantInfo kRotorConstants[] = {
    {"m", "kg", "mass", RotorConstantGroup::kMotion, 0.01, 0.2, true},
    {"I_x", "kg m^2", "moment of inertia about body x", RotorConstantGroup::kMotion, 1e-4, 0.3,
     true},
    {"I_y", "kg m^2", "moment of inertia about body y", RotorConstantGroup::kMotion, 1e-4, 0.3,
     true},
    {"I_z", "kg m^2", "moment of inertia about body z", RotorConstantGroup::kMotion, 1e-4, 0.3,
     true},
    {"r_BM_x", "m", "centre of mass along x", RotorConstantGroup::kMotion, 0.01, 0.02},
    {"r_BM_y", "m", "centre of mass along y", RotorConstantGroup::kMotion, 0.01, 0.02},
    {"r_BM_z", "m", "centre of mass along z", RotorConstantGroup::kMotion, 0.01, 0.02},
    {"r_BP_x", "m", "pose sensor along x", RotorConstantGroup::kPose, 0.01, 0.05},
    {"r_BP_y", "m", "pose sensor along y", RotorConstantGroup::kPose, 0.01, 0.05},
    {"r_BP_z", "m", "pose sensor along z", RotorConstantGroup::kPose, 0.01, 0.05},
    {"r_BI_x", "m", "IMU along x", RotorConstantGroup::kImuArm, 0.01, 0.02},
    {"r_BI_y", "m", "IMU along y", RotorConstantGroup::kImuArm, 0.01, 0.02},
    {"r_BI_z", "m", "IMU along z", RotorConstantGroup::kImuArm, 0.01},
    {"b_a_x", "m/s^2", "accelerometer bias along x", RotorConstantGroup::kBias, 0.1, 0.5},
    {"b_a_y", "m/s^2", "accelerometer bias along y", RotorConstantGroup::kBias, 0.1, 0.5},
    {"b_a_z", "m/s^2", "accelerometer bias along z", RotorConstantGroup::kBias, 0.1, 0.5},
    {"b_w_x", "rad/s", "gyro bias along x", RotorConstantGroup::kBias, 0.01, 0.1},
    {"b_w_y", "rad/s", "gyro bias along y", RotorConstantGroup::kBias, 0.01, 0.1},
    {"b_w_z", "rad/s", "gyro bias along z", RotorConstantGroup::kBias, 0.01, 0.1},
    {"k_f", "1", "scale of thrust", RotorConstantGroup::kMotion, 0.1},
    {"k_m", "1", "scale of the rotors' reaction moment", RotorConstantGroup::kMotion, 0.1},
    // Beyond the model of Boehm et al. 2020.
    {"K_x", "1/s", "linear drag along body x, by mass", RotorConstantGroup::kMotion, 0.1},
    {"K_y", "1/s", "linear drag along body y, by mass", RotorConstantGroup::kMotion, 0.1},
    {"K_z", "1/s", "linear drag along body z, by mass", RotorConstantGroup::kMotion, 0.1},
    {"inflow", "1", "thrust lost in a climb", RotorConstantGroup::kMotion, 1e-5},
    // Derivatives of the angular acceleration by turn rate and speed, named as flight mechanics
    // does (Etkin and Reid 1996, Dynamics of Flight, ch. 4).
    {"L_p", "1/s", "damping of roll", RotorConstantGroup::kMotion, 1.0},
    {"M_q", "1/s", "damping of pitch", RotorConstantGroup::kMotion, 1.0},
    {"N_r", "1/s", "damping of yaw", RotorConstantGroup::kMotion, 1.0},
    {"L_v", "rad/m/s", "roll acceleration by air speed along y", RotorConstantGroup::kMotion, 0.5},
    {"M_u", "rad/m/s", "pitch acceleration by air speed along x", RotorConstantGroup::kMotion, 0.5},
    {"J_r", "kg m^2", "inertia of a rotor about its axis", RotorConstantGroup::kMotion, 1e-6},
    {"pose_delay", "s", "age of a pose at its stamp", RotorConstantGroup::kPose, 0.01},
    {"motor_lag", "s", "lag of the rotors behind their commands", RotorConstantGroup::kCommands,
     0.01},
    {"motor_idle", "1", "share of full speed at a command just above zero",
     RotorConstantGroup::kCommands, 0.1},
    {"motor_voltage", "1", "exponent of the battery's voltage in the rotors' speed",
     RotorConstantGroup::kCommands, 0.1},
};

// -1 if there is no such constant.
constexpr int FindRotorConstant(std::string_view name) {
  for (int i = 0; i < static_cast<int>(std::size(kRotorConstants)); ++i) {
    if (kRotorConstants[i].name == name) return i;
  }
  return -1;
}

}  // namespace trueline
