#include "problems/simulation/ahrs.h"

#include <algorithm>
#include <cmath>

namespace trueline::simulation {

void AhrsFilter::Start(const Quaterniond& q_E_I, const Vector3d& accel_bias,
                       const Vector3d& gyro_bias, double gravity) {
  const Vector3d up_I = q_E_I.conjugate() * Vector3d(0.0, 0.0, -gravity);
  const Quaterniond lean = TurnBetween(up_I + accel_bias, up_I);
  q_Ep_I_ = q_E_I * lean;
  integral_ = -gyro_bias;
}

void AhrsFilter::Update(double dt, const ImuReading& reading, double heading) {
  const Vector3d down_I = q_Ep_I_.conjugate() * Vector3d::UnitZ();
  const Vector3d tilt_error = -reading.accel.normalized().cross(down_I);
  const double heading_error = WrapAngle(heading - HeadingOf(q_Ep_I_));
  const double ratio = config_.integral_gain / std::max(config_.tilt_gain, 1e-9);
  const Vector3d correction =
      config_.tilt_gain * tilt_error + config_.heading_gain * heading_error * down_I;
  integral_ += ratio * dt * correction;
  q_Ep_I_ = q_Ep_I_ * RotationByVector(dt * (reading.gyro + correction + integral_));
  q_Ep_I_.normalize();
}

Ahrs::Ahrs(const AhrsConfig& config, const ImuConfig& imu, double gravity, std::uint64_t seed,
           const Stages& stages)
    : config_(config),
      imu_(imu),
      gravity_(gravity),
      stages_(stages),
      q_B_I_(FrameChange(imu.misalignment)),
      filter_(config),
      drift_(config.drift_sigma, config.drift_memory, seed, "ahrs_drift"),
      walk_(config.drift_density, seed, "ahrs_walk") {}

// R_Ep_E, the rotation from the true earth to the AHRS's.
Quaterniond Ahrs::ErrorBeforeEffects(const Motion& motion, const ImuReading& reading,
                                     const Quaterniond& q_E_I) {
  if (config_.kind == AhrsKind::kComplementaryFilter) {
    if (started_) filter_.Update(motion.dt, reading, HeadingOf(q_E_I) + config_.heading_error);
    if (!started_) filter_.Start(q_E_I, imu_.accel_bias, imu_.gyro_bias, gravity_);
    started_ = true;
    return filter_.q_Ep_I() * q_E_I.conjugate();
  }
  if (config_.kind == AhrsKind::kConstantError) return FrameChange(config_.constant);
  drift_.Advance(motion.dt);
  walk_.Advance(motion.dt);
  return FrameChange(config_.constant + drift_.value() + walk_.value());
}

// Eq. 14 solved for the AHRS: R_Ep_I = R_Ep_E R_E_B R_B_I. Effects rotate E' further, as seen from
// E.
Quaterniond Ahrs::Update(const Motion& motion, const ImuReading& reading) {
  const Quaterniond q_E_I = motion.q_E_B * q_B_I_;
  Vector3d added = Vector3d::Zero();
  Apply(stages_.ahrs_error, motion, &added);
  const Quaterniond error = ErrorBeforeEffects(motion, reading, q_E_I) * FrameChange(added);
  return (error * q_E_I).normalized();
}

}  // namespace trueline::simulation
