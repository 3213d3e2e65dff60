// The vehicle's own sensors: a strap-down IMU, which reads specific force and rate in its frame I
// with errors of real ones, and the AHRS that estimates the attitude by it.
#pragma once

#include <algorithm>
#include <cmath>

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
  Vibration(const VibrationConfig& config, int rotors, std::uint64_t seed)
      : phase_(RotorArray::Zero(rotors)) {
    Random random(seed, "vibration");
    const std::size_t harmonics = std::max(config.accel.size(), config.gyro.size());
    for (int rotor = 0; rotor < rotors; ++rotor) {
      for (std::size_t i = 0; i < harmonics; ++i) {
        const double accel = i < config.accel.size() ? config.accel[i] : 0.0;
        const double gyro = i < config.gyro.size() ? config.gyro[i] : 0.0;
        const double start = random.Uniform(-M_PI, M_PI);
        const Vector3d accel_direction = random.NormalVector3().normalized();
        const Vector3d gyro_direction = random.NormalVector3().normalized();
        shakes_.push_back({rotor, static_cast<double>(i + 1), start, accel * accel_direction,
                           gyro * gyro_direction});
      }
    }
  }
  void Advance(double dt, const RotorArray& rotors) { phase_ += dt * rotors; }
  void AddTo(ImuReading* reading) const {
    for (const Shake& shake : shakes_) {
      const double wave = std::sin(shake.harmonic * phase_[shake.rotor] + shake.start);
      reading->accel += wave * shake.accel;
      reading->gyro += wave * shake.gyro;
    }
  }

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
  Imu(const ImuConfig& config, int rotors, std::uint64_t seed, const Stages& stages)
      : config_(config),
        stages_(stages),
        q_I_B_(FrameChange(config.misalignment).conjugate()),
        accel_noise_(seed, "accel_noise"),
        gyro_noise_(seed, "gyro_noise"),
        accel_walk_(Vector3d::Constant(config.accel_bias_walk), seed, "accel_bias_walk"),
        gyro_walk_(Vector3d::Constant(config.gyro_bias_walk), seed, "gyro_bias_walk"),
        vibration_(config.vibration, rotors, seed) {}

  // The reading at the true motion; `f_B` is specific force at the origin of B (m/s^2).
  ImuReading Sample(const Motion& motion, const Vector3d& f_B, const RotorArray& rotors) {
    vibration_.Advance(motion.dt, rotors);
    accel_walk_.Advance(motion.dt);
    gyro_walk_.Advance(motion.dt);
    ImuReading reading = Ideal(motion, f_B);
    vibration_.AddTo(&reading);
    // Under a density n the mean over T seconds has the variance n^2 / T (velocity and angle random
    // walk), so one sample has n^2 * rate.
    const double root_rate = std::sqrt(config_.rate);
    reading.accel += config_.accel_noise_density * root_rate * accel_noise_.NormalVector3();
    reading.gyro += config_.gyro_noise_density * root_rate * gyro_noise_.NormalVector3();
    reading.accel = Digitise(reading.accel, config_.accel_range, config_.accel_step);
    reading.gyro = Digitise(reading.gyro, config_.gyro_range, config_.gyro_step);
    return reading;
  }

 private:
  // Saturation beyond +-range and rounding to multiples of `step`; 0 switches either off.
  static Vector3d Digitise(const Vector3d& value, double range, double step) {
    Vector3d result = value;
    for (double& axis : result) {
      if (range > 0.0) axis = std::clamp(axis, -range, range);
      if (step > 0.0) axis = step * std::round(axis / step);
    }
    return result;
  }
  // a_m = (1 + s) R_I_B (f_B + lever arm) + b(t), w_m = R_I_B w_B + b.
  ImuReading Ideal(const Motion& motion, const Vector3d& f_B) const {
    ImuReading reading;
    Vector3d at_imu_B = f_B;
    Apply(stages_.at_imu, motion, &at_imu_B);
    reading.accel = q_I_B_ * at_imu_B;
    Apply(stages_.accel_scale, &reading.accel);
    Vector3d bias = config_.accel_bias + accel_walk_.value();
    Apply(stages_.accel_bias, motion.t, &bias);
    reading.accel += bias;
    reading.accel_walk = accel_walk_.value();
    reading.gyro = q_I_B_ * motion.w_B + config_.gyro_bias + gyro_walk_.value();
    return reading;
  }

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
             double gravity) {
    const Vector3d up_I = q_E_I.conjugate() * Vector3d(0.0, 0.0, -gravity);
    const Quaterniond lean = TurnBetween(up_I + accel_bias, up_I);
    q_Ep_I_ = q_E_I * lean;
    integral_ = -gyro_bias;
  }
  // `heading`: reference for the heading of I (rad).
  void Update(double dt, const ImuReading& reading, double heading) {
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
       const Stages& stages)
      : config_(config),
        imu_(imu),
        gravity_(gravity),
        stages_(stages),
        q_B_I_(FrameChange(imu.misalignment)),
        filter_(config),
        drift_(config.drift_sigma, config.drift_memory, seed, "ahrs_drift"),
        walk_(config.drift_density, seed, "ahrs_walk") {}

  // Attitude q_Ep_I after the reading at the true `motion`.
  // Eq. 14 solved for the AHRS: R_Ep_I = R_Ep_E R_E_B R_B_I. Effects rotate E' further, as seen
  // from E.
  Quaterniond Update(const Motion& motion, const ImuReading& reading) {
    const Quaterniond q_E_I = motion.q_E_B * q_B_I_;
    Vector3d added = Vector3d::Zero();
    Apply(stages_.ahrs_error, motion, &added);
    const Quaterniond error = ErrorBeforeEffects(motion, reading, q_E_I) * FrameChange(added);
    return (error * q_E_I).normalized();
  }

 private:
  // R_Ep_E, the rotation from the true earth to the AHRS's.
  Quaterniond ErrorBeforeEffects(const Motion& motion, const ImuReading& reading,
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
