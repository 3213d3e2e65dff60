// A strap-down IMU: specific force and rate in its frame I, with errors of real ones.
#pragma once

#include "problems/simulation/airframe.h"
#include "problems/simulation/noise.h"

namespace trueline::simulation {

struct ImuReading {
  Vector3d accel;                          // m/s^2, in I
  Vector3d gyro;                           // rad/s, in I
  Vector3d accel_walk = Vector3d::Zero();  // random walk of the bias, included in accel
};

// Vibration by the rotors: each rotor adds a sinusoid at each harmonic of its own frequency, in a
// direction of its own. Sampled without an anti-alias filter, so frequencies above half the IMU's
// rate alias, as on small drones.
class Vibration {
 public:
  Vibration(const VibrationConfig& config, int rotors, std::uint64_t seed);
  void Advance(double dt, const RotorArray& rotors);
  void AddTo(ImuReading* reading) const;

 private:
  struct Shake {
    int rotor;
    double harmonic;
    double start;          // rad
    Vector3d accel, gyro;  // amplitude times direction
  };
  std::vector<Shake> shakes_;
  RotorArray phase_;  // rad
};

class Imu {
 public:
  Imu(const ImuConfig& config, int rotors, std::uint64_t seed, const Stages& stages);

  // The reading at the true motion; `f_B` is specific force at the origin of B (m/s^2).
  ImuReading Sample(const Motion& motion, const Vector3d& f_B, const RotorArray& rotors);

 private:
  ImuReading Ideal(const Motion& motion, const Vector3d& f_B) const;

  ImuConfig config_;
  const Stages& stages_;
  Quaterniond q_I_B_;
  Random accel_noise_, gyro_noise_;
  Wiener accel_walk_, gyro_walk_;
  Vibration vibration_;
};

}  // namespace trueline::simulation
