// Motors of the simulated vehicle, commanded as a share of the battery's voltage. The speed
// controller knows the motors' curve at the nominal voltage but not the battery, whose voltage
// falls with charge and under load. Written independently of the estimators' motor model.
#pragma once

#include <cmath>

#include "problems/common/strict_yaml.h"
#include "problems/simulation/airframe.h"

namespace trueline::simulation {

struct MotorDriveConfig {
  double full_speed = 2200.0;    // rad/s, at full command and nominal voltage
  double nominal_voltage = 7.4;  // V
  double idle = 0.15;            // share of full speed at a command just above zero
  double voltage = 1.0;          // exponent with which speed follows voltage
  double battery = 7.8;          // V, at the start and without load
  double drop = 0.02;            // V/s
  double sag = 0.4;              // V, at full command on all rotors
  double battery_sigma = 0.005;  // V, of a reading
  double battery_rate = 10.0;    // Hz
};

class MotorDrive {
 public:
  explicit MotorDrive(const MotorDriveConfig& config) : config_(config) {}

  // Commands (0 to 1) that give the rotors `speeds` (rad/s) at the nominal voltage.
  RotorArray CommandFor(const RotorArray& speeds) const {
    const RotorArray share = speeds / config_.full_speed;
    return ((share - config_.idle) / (1.0 - config_.idle)).max(0.0).min(1.0);
  }
  // V at time `t` (s) under these commands.
  double Voltage(double t, const RotorArray& command) const {
    return config_.battery - config_.drop * t - config_.sag * command.mean();
  }
  // Steady-state rotor speeds (rad/s).
  RotorArray SettledSpeed(double t, const RotorArray& command) const {
    const double strength =
        std::pow(Voltage(t, command) / config_.nominal_voltage, config_.voltage);
    const RotorArray turning = (command > 0.0).cast<double>();
    return turning * strength * config_.full_speed * (config_.idle * (1.0 - command) + command);
  }

 private:
  MotorDriveConfig config_;
};

}  // namespace trueline::simulation
