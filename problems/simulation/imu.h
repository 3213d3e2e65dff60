// The vehicle's own sensors: a strap-down IMU, which reads specific force and rate in its frame I
// with errors of real ones, and the AHRS that estimates the attitude by it.
#pragma once

#include "problems/common/random.h"
#include "problems/simulation/airframe.h"

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

// The complementary filter of Li et al. 2019, fig. 3, on quaternions: the gyroscope is integrated;
// the accelerometer's direction of gravity and a heading reference correct it, proportionally and
// by an integral that converges to minus the gyroscope's bias.
class AhrsFilter {
 public:
  explicit AhrsFilter(const AhrsConfig& config) : config_(config) {}

  // Starts on the ground at the true attitude: levelled by the accelerometer at rest (whose bias
  // tilts E'), gyroscope calibrated.
  void Start(const Quaterniond& q_E_I, const Vector3d& accel_bias, const Vector3d& gyro_bias,
             double gravity);
  // `heading`: reference for the heading of I (rad).
  void Update(double dt, const ImuReading& reading, double heading);
  const Quaterniond& q_Ep_I() const { return q_Ep_I_; }

 private:
  AhrsConfig config_;
  Quaterniond q_Ep_I_ = Quaterniond::Identity();
  Vector3d integral_ = Vector3d::Zero();  // rad/s
};

// One AHRS of the configured kind, with the effects that act on it.
class Ahrs {
 public:
  Ahrs(const AhrsConfig& config, const ImuConfig& imu, double gravity, std::uint64_t seed,
       const Stages& stages);

  // Attitude q_Ep_I after the reading at the true `motion`.
  Quaterniond Update(const Motion& motion, const ImuReading& reading);

 private:
  Quaterniond ErrorBeforeEffects(const Motion& motion, const ImuReading& reading,
                                 const Quaterniond& q_E_I);

  AhrsConfig config_;
  ImuConfig imu_;
  double gravity_;
  const Stages& stages_;
  Quaterniond q_B_I_;
  AhrsFilter filter_;
  bool started_ = false;
  OrnsteinUhlenbeck drift_;
  Wiener walk_;
};

}  // namespace trueline::simulation
