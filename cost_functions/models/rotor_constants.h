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
  RotorConstantGroup group;
  double typical;         // a typical change, which scales numerical ranks
  double sigma = 0.0;     // of the default prior, for a new payload; zero: known
  bool relative = false;  // sigma is a share of the nominal value
};

inline constexpr RotorConstantInfo kRotorConstants[] = {
    {"m", "kg", RotorConstantGroup::kMotion, 0.01, 0.2, true},
    {"I_x", "kg m^2", RotorConstantGroup::kMotion, 1e-4, 0.3, true},
    {"I_y", "kg m^2", RotorConstantGroup::kMotion, 1e-4, 0.3, true},
    {"I_z", "kg m^2", RotorConstantGroup::kMotion, 1e-4, 0.3, true},
    {"r_BM_x", "m", RotorConstantGroup::kMotion, 0.01, 0.02},  // centre of mass in B
    {"r_BM_y", "m", RotorConstantGroup::kMotion, 0.01, 0.02},
    {"r_BM_z", "m", RotorConstantGroup::kMotion, 0.01, 0.02},
    {"r_BP_x", "m", RotorConstantGroup::kPose, 0.01, 0.05},  // pose sensor
    {"r_BP_y", "m", RotorConstantGroup::kPose, 0.01, 0.05},
    {"r_BP_z", "m", RotorConstantGroup::kPose, 0.01, 0.05},
    {"r_BI_x", "m", RotorConstantGroup::kImuArm, 0.01, 0.02},  // IMU
    {"r_BI_y", "m", RotorConstantGroup::kImuArm, 0.01, 0.02},
    {"r_BI_z", "m", RotorConstantGroup::kImuArm, 0.01},
    {"b_a_x", "m/s^2", RotorConstantGroup::kBias, 0.1, 0.5},
    {"b_a_y", "m/s^2", RotorConstantGroup::kBias, 0.1, 0.5},
    {"b_a_z", "m/s^2", RotorConstantGroup::kBias, 0.1, 0.5},
    {"b_w_x", "rad/s", RotorConstantGroup::kBias, 0.01, 0.1},
    {"b_w_y", "rad/s", RotorConstantGroup::kBias, 0.01, 0.1},
    {"b_w_z", "rad/s", RotorConstantGroup::kBias, 0.01, 0.1},
    {"k_f", "1", RotorConstantGroup::kMotion, 0.1},  // scales of the nominal values
    {"k_m", "1", RotorConstantGroup::kMotion, 0.1},
    // Beyond the model of Boehm et al. 2020.
    {"K_x", "1/s", RotorConstantGroup::kMotion, 0.1},
    {"K_y", "1/s", RotorConstantGroup::kMotion, 0.1},
    {"K_z", "1/s", RotorConstantGroup::kMotion, 0.1},
    {"inflow", "1", RotorConstantGroup::kMotion, 1e-5},
    // Derivatives of the angular acceleration by turn rate and speed, named as flight mechanics
    // does (Etkin and Reid 1996, Dynamics of Flight, ch. 4).
    {"L_p", "1/s", RotorConstantGroup::kMotion, 1.0},
    {"M_q", "1/s", RotorConstantGroup::kMotion, 1.0},
    {"N_r", "1/s", RotorConstantGroup::kMotion, 1.0},
    {"L_v", "rad/m/s", RotorConstantGroup::kMotion, 0.5},
    {"M_u", "rad/m/s", RotorConstantGroup::kMotion, 0.5},
    {"J_r", "kg m^2", RotorConstantGroup::kMotion, 1e-6},  // of one rotor, about its axis
    {"pose_delay", "s", RotorConstantGroup::kPose, 0.01},
    {"motor_lag", "s", RotorConstantGroup::kCommands, 0.01},
    {"motor_idle", "1", RotorConstantGroup::kCommands, 0.1},
    {"motor_voltage", "1", RotorConstantGroup::kCommands, 0.1},
};

// -1 if there is no such constant.
constexpr int FindRotorConstant(std::string_view name) {
  for (int i = 0; i < static_cast<int>(std::size(kRotorConstants)); ++i) {
    if (kRotorConstants[i].name == name) return i;
  }
  return -1;
}

}  // namespace trueline
