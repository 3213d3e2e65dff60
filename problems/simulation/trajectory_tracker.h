// Flies a trajectory in flat outputs: feed-forward of attitude, rates and moments from the flat
// map, feedback on SE(3) (Lee, Leok and McClamroch 2010). Rotor speeds fed forward alone diverge
// within seconds.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "problems/simulation/airframe.h"
#include "problems/simulation/imu.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline::simulation {

// State estimate of the vehicle in flight: dead reckoning on its IMU, corrected by its pose sensor
// with fixed gains. The tracker uses this estimate as real vehicles do. Feedback of the true state
// would put information on the truth into the rotor speeds, and estimators that treat the speeds as
// an input would be biased.
struct NavigatorConfig {
  double gravity = 9.81;  // m/s^2
  Vector3d accel_bias = Vector3d::Zero(), gyro_bias = Vector3d::Zero();
  Vector3d pose_arm = Vector3d::Zero();  // m, of P from M
  double attitude_gain = 0.3;            // share of a pose's difference that is taken over
  double position_gain = 0.3;
  double velocity_gain = 2.0;  // 1/s
};

class Navigator {
 public:
  Navigator(const NavigatorConfig& config, const BodyState& start)
      : config_(config), state_(start) {}

  const BodyState& state() const { return state_; }

  void Add(const ImuReading& reading, double dt) {
    const Quaterniond q = state_.Attitude();
    const Vector3d w = reading.gyro - config_.gyro_bias;
    const Vector3d a_E =
        q * (reading.accel - config_.accel_bias) + Vector3d(0.0, 0.0, config_.gravity);
    state_.p_E += dt * (state_.v_E + 0.5 * dt * a_E);
    state_.v_E += dt * a_E;
    state_.q_E_B = (q * RotationByVector(dt * w)).normalized().coeffs();
    state_.w_B += (1.0 - std::exp(-dt / kRateFilter)) * (w - state_.w_B);
  }

  void AddPose(const Vector3d& p_E, const Quaterniond& q_E_P) {
    const Quaterniond q = state_.Attitude();
    const Vector3d miss = p_E - (state_.p_E + q * config_.pose_arm);
    state_.q_E_B = q.slerp(config_.attitude_gain, q_E_P).coeffs();
    state_.p_E += config_.position_gain * miss;
    state_.v_E += config_.velocity_gain * miss;
  }

 private:
  static constexpr double kRateFilter = 0.008;  // s, of the gyro

  NavigatorConfig config_;
  BodyState state_;
};

struct TrackerGains {
  double position = 9.0;   // 1/s^2
  double velocity = 5.0;   // 1/s
  double attitude = 10.0;  // 1/s
  double rate = 25.0;      // 1/s
};

class TrajectoryTracker {
 public:
  // `step`: s between commands. `min_speed`, `max_speed`: rad/s, saturation of the rotors. `lag`:
  // s, of the rotor speed behind the command.
  TrajectoryTracker(const RotorFlight& flight, double gravity, double step, double min_speed,
                    double max_speed, double lag, const TrackerGains& gains = {});

  int num_steps() const { return static_cast<int>(wanted_.size()) - 1; }
  // State of the reference at its start, rotors at the reference's speeds.
  BodyState Start() const;
  // Rotor speeds (rad/s) wanted at the beginning of step `k`.
  RotorArray Command(int k, const BodyState& state) const;
  // Position of the reference at step `k`, m.
  const Vector3d& PositionAt(int k) const { return wanted_[k].p_E; }

 private:
  struct Wanted {
    Vector3d p_E, v_E, a_E;
    Quaterniond q_E_B;
    Vector3d w_B, dw_B;
    double yaw;
    RotorArray rotors;
  };
  static Wanted Sample(const RotorFlight& flight, double t);
  RotorArray SpeedsFor(double thrust, const Vector3d& moment) const;

  FlatVehicle vehicle_;
  double gravity_, min_speed_, max_speed_;
  int lead_;  // steps
  TrackerGains gains_;
  std::vector<Wanted> wanted_;
};

}  // namespace trueline::simulation
