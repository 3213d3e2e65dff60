// Flies a trajectory in flat outputs: feed-forward of attitude, rates and moments from the flat
// map, feedback on SE(3) (Lee, Leok and McClamroch 2010). Rotor speeds fed forward alone diverge
// within seconds.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
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
                    double max_speed, double lag, const TrackerGains& gains = {})
      : vehicle_(flight.vehicle()),
        gravity_(gravity),
        min_speed_(min_speed),
        max_speed_(max_speed),
        lead_(static_cast<int>(std::lround(lag / step))),
        gains_(gains) {
    const int steps = static_cast<int>(std::floor(flight.path().duration() / step + 1e-9));
    wanted_.reserve(steps + 1);
    for (int k = 0; k <= steps; ++k) {
      wanted_.push_back(Sample(flight, flight.path().start() + k * step));
    }
    for (int k = 0; k <= steps; ++k) {
      const int before = std::max(0, k - 1), after = std::min(steps, k + 1);
      wanted_[k].dw_B = (wanted_[after].w_B - wanted_[before].w_B) / ((after - before) * step);
    }
  }

  int num_steps() const { return static_cast<int>(wanted_.size()) - 1; }
  // State of the reference at its start, rotors at the reference's speeds.
  BodyState Start() const {
    const Wanted& first = wanted_.front();
    BodyState state;
    state.p_E = first.p_E;
    state.v_E = first.v_E;
    state.q_E_B = first.q_E_B.coeffs();
    state.w_B = first.w_B;
    state.rotors = first.rotors;
    return state;
  }
  // Rotor speeds (rad/s) wanted at the beginning of step `k`.
  RotorArray Command(int k, const BodyState& state) const {
    const Wanted& wanted = wanted_[k];
    // The reference is read ahead by the rotors' lag.
    const Wanted& ahead = wanted_[std::min(k + lead_, num_steps())];
    const Vector3d thrust_E = wanted.a_E + gains_.position * (wanted.p_E - state.p_E) +
                              gains_.velocity * (wanted.v_E - state.v_E) -
                              Vector3d(0.0, 0.0, gravity_);
    const Quaterniond q_E_B = state.Attitude();
    const Quaterniond q_B_wanted = q_E_B.conjugate() * NoseTowards(thrust_E, wanted.yaw);
    const Quaterniond q_B_reference = q_E_B.conjugate() * wanted.q_E_B;
    const Vector3d w = q_B_reference * wanted.w_B + gains_.attitude * SmallTurn(q_B_wanted);
    const Vector3d dw = q_B_reference * ahead.dw_B + gains_.rate * (w - state.w_B);
    const Vector3d momentum = vehicle_.inertia.cwiseProduct(state.w_B);
    return SpeedsFor(
        -vehicle_.mass * (thrust_E + ahead.a_E - wanted.a_E).dot(q_E_B * Vector3d::UnitZ()),
        vehicle_.inertia.cwiseProduct(dw) + state.w_B.cross(momentum));
  }
  // Position of the reference at step `k`, m.
  const Vector3d& PositionAt(int k) const { return wanted_[k].p_E; }

 private:
  // R_E_B as a quaternion: -z_B along the wanted `thrust_E`, the nose above or below `heading`
  // (rad), as trajectories state it (rotations about z, then y, then x;
  // problems/trajectory/rotor_flight.h).
  static Quaterniond NoseTowards(const Vector3d& thrust_E, double heading) {
    const Vector3d z = -thrust_E.normalized();
    const Vector3d x = Vector3d(-std::sin(heading), std::cos(heading), 0.0).cross(z).normalized();
    Eigen::Matrix3d R_E_B;
    R_E_B << x, z.cross(x), z;
    return Quaterniond(R_E_B);
  }

  struct Wanted {
    Vector3d p_E, v_E, a_E;
    Quaterniond q_E_B;
    Vector3d w_B, dw_B;
    double yaw;
    RotorArray rotors;
  };
  static Wanted Sample(const RotorFlight& flight, double t) {
    using Model = RotorDrivenModel;
    const NominalPoint point = flight.At(t);
    const double* x = point.x.data();
    const FlatMatrix flat = flight.path().Expand(t, 2);
    Wanted wanted;
    wanted.p_E = Eigen::Map<const Vector3d>(x + Model::kPosition);
    wanted.v_E = Eigen::Map<const Vector3d>(x + Model::kVelocity);
    wanted.a_E = 2.0 * flat.block<3, 1>(0, 2);
    wanted.q_E_B = Quaterniond(x[0], x[1], x[2], x[3]);
    wanted.w_B = Eigen::Map<const Vector3d>(x + Model::kRate);
    wanted.yaw = flat(3, 0);
    wanted.rotors.resize(static_cast<Eigen::Index>(point.u.size()));
    for (std::size_t i = 0; i < point.u.size(); ++i) {
      wanted.rotors[i] = std::sqrt(std::max(point.u[i], 0.0));
    }
    return wanted;
  }
  // Where a rotor would saturate, the yaw moment is reduced first, as in usual flight controllers:
  // yaw takes much of the rotors' range, and the vehicle can fly without yaw control but not
  // without roll and pitch.
  RotorArray SpeedsFor(double thrust, const Vector3d& moment) const {
    const double low = min_speed_ * min_speed_, high = max_speed_ * max_speed_;
    RotorArray squared;
    for (const double yaw : {1.0, 0.8, 0.6, 0.4, 0.2, 0.0}) {
      const Eigen::Vector4d wrench(thrust, moment.x(), moment.y(), yaw * moment.z());
      squared = (vehicle_.speeds_from_wrench * wrench).array();
      if (squared.minCoeff() >= low && squared.maxCoeff() <= high) break;
    }
    return squared.max(low).min(high).sqrt();
  }

  FlatVehicle vehicle_;
  double gravity_, min_speed_, max_speed_;
  int lead_;  // steps
  TrackerGains gains_;
  std::vector<Wanted> wanted_;
};

}  // namespace trueline::simulation
