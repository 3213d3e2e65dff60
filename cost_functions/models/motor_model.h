// Rotor speeds from motor commands: steady speed and first-order lag.
//
//   steady speed = full_speed (V / nominal_voltage)^voltage (idle + (1 - idle) u)
//   d omega / dt = (steady speed - omega) / lag
//
// with the command u from 0 to 1 and the battery's voltage V. Thrust curves of small motors have an
// idle share above zero (Foerster 2015: 381 + 0.0408 PWM in rad/s for a Crazyflie). The exponent
// `voltage` is 1 where the command is a share of the battery's voltage, 0 where a controller holds
// the speed.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace trueline {

// Known values of the motors.
struct MotorCurve {
  double full_speed = 0.0;       // rad/s, at u = 1 and nominal voltage
  double nominal_voltage = 1.0;  // V
};

// Values that may be estimated, in the order of RotorAeroModel's constants.
enum MotorUnknown : int { kLag, kIdle, kVoltage, kMotorUnknowns };  // s, 1, 1
using MotorValues = Eigen::Matrix<double, kMotorUnknowns, 1>;

// A rotor's speed [rad/s] with its derivatives by the unknowns.
struct MotorSpeed {
  double value = 0.0;
  MotorValues slope = MotorValues::Zero();
};

// A command of zero stops the motor.
inline MotorSpeed SteadySpeed(const MotorCurve& curve, const MotorValues& at, double command,
                              double voltage) {
  if (command <= 0.0) return {};
  const double ratio = voltage / curve.nominal_voltage;
  const double full = curve.full_speed * std::pow(ratio, at[kVoltage]);
  const double speed = full * (at[kIdle] + (1.0 - at[kIdle]) * command);
  return {speed, MotorValues(0.0, full * (1.0 - command), speed * std::log(ratio))};
}

// The speed after `dt` seconds at a constant steady speed.
inline MotorSpeed AfterLag(const MotorSpeed& now, const MotorSpeed& steady, double lag, double dt) {
  const double left = std::exp(-dt / lag);
  MotorSpeed later{steady.value + left * (now.value - steady.value),
                   steady.slope + left * (now.slope - steady.slope)};
  later.slope[kLag] += (now.value - steady.value) * left * dt / (lag * lag);
  return later;
}

}  // namespace trueline
