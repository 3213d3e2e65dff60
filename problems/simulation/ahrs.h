// The drone's own estimate of its attitude.
#pragma once

#include "problems/simulation/imu.h"

namespace trueline::simulation {

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
