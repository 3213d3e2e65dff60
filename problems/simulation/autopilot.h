// Flies the drone along the path. It uses the true state, as the paper's flights did, which were
// controlled by motion capture. It measures unmodelled forces and compensates them (incremental
// inversion), so that effects change the log and not the course.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "problems/simulation/airframe.h"
#include "problems/simulation/course.h"

namespace trueline::simulation {

class Autopilot {
 public:
  Autopilot(const VehicleConfig& vehicle, const AutopilotConfig& config, double gravity)
      : vehicle_(vehicle), config_(config), gravity_(gravity) {
    const int count = static_cast<int>(vehicle.rotors.size());
    allocation_.resize(4, count);
    for (int i = 0; i < count; ++i) {
      const Rotor& rotor = vehicle.rotors[i];
      allocation_(0, i) = -rotor.k_f * rotor.axis.z();
      allocation_.block<3, 1>(1, i) =
          rotor.position.cross(rotor.k_f * rotor.axis) + rotor.spin * rotor.k_m * rotor.axis;
    }
    inverse_allocation_ = allocation_.completeOrthogonalDecomposition().pseudoInverse();
  }

  // Wanted rotor speeds (rad/s) for a state and its rate of change `now`. Place, speed and heading
  // are those of `position`; accelerations are those of `ahead`, the reference ahead by the
  // attitude's lag.
  RotorArray Command(double dt, const BodyState& state, const BodyRate& now,
                     const PathPoint& position, const PathPoint& ahead) {
    MeasureDisturbance(dt, state, now);
    const Quaterniond q_E_B = state.Attitude();
    const Vector3d thrust_E = WantedThrust(state, position, ahead);
    const Vector3d rate = WantedRate(q_E_B, AttitudeFor(thrust_E, position.heading), ahead);
    const Vector3d dw_B = config_.rate_gain.cwiseProduct(rate - state.w_B) - unmodelled_dw_B_;
    Eigen::Vector4d wrench;
    wrench[0] = -vehicle_.mass * thrust_E.dot(q_E_B * Vector3d::UnitZ());
    wrench.tail<3>() = vehicle_.inertia.cwiseProduct(dw_B) +
                       state.w_B.cross(vehicle_.inertia.cwiseProduct(state.w_B));
    return SpeedsFor(wrench);
  }
  // Attitude and rotor speeds for steady flight at the start.
  BodyState Trim(const PathPoint& start) const {
    BodyState state;
    state.p_E = start.p_E;
    state.v_E = start.v_E;
    const Vector3d thrust_E = start.a_E - Vector3d(0.0, 0.0, gravity_);
    state.q_E_B = AttitudeFor(thrust_E, start.heading).coeffs();
    state.w_B = state.Attitude().conjugate() * Vector3d(0.0, 0.0, start.heading_rate);
    state.rotors = SpeedsFor({vehicle_.mass * thrust_E.norm(), 0.0, 0.0, 0.0});
    return state;
  }

 private:
  Eigen::Vector4d NominalWrench(const RotorArray& rotors) const {
    return allocation_ * rotors.square().matrix();
  }  // N up, N m
  RotorArray SpeedsFor(const Eigen::Vector4d& wrench) const {
    const double limit = vehicle_.max_rotor_speed;
    const RotorArray squared = (inverse_allocation_ * wrench).array();
    return squared.max(0.01 * limit * limit).min(limit * limit).sqrt();
  }
  void MeasureDisturbance(double dt, const BodyState& state, const BodyRate& now) {
    const Eigen::Vector4d wrench = NominalWrench(state.rotors);
    const Vector3d f_B = now.f_B + Vector3d(0.0, 0.0, wrench[0] / vehicle_.mass);
    const Vector3d gyroscopic = state.w_B.cross(vehicle_.inertia.cwiseProduct(state.w_B));
    const Vector3d modelled = (wrench.tail<3>() - gyroscopic).cwiseQuotient(vehicle_.inertia);
    const double share = 1.0 - std::exp(-dt / config_.disturbance_time);
    unmodelled_f_B_ += share * (f_B - unmodelled_f_B_);
    unmodelled_dw_B_ += share * (now.rate.w_B - modelled - unmodelled_dw_B_);
  }
  // Specific thrust (m/s^2, in E) that brings the wanted acceleration; never more than max_tilt
  // from up.
  Vector3d WantedThrust(const BodyState& state, const PathPoint& position,
                        const PathPoint& ahead) const {
    const Vector3d a_E = ahead.a_E + config_.position_gain * (position.p_E - state.p_E) +
                         config_.velocity_gain * (position.v_E - state.v_E);
    Vector3d thrust_E = a_E - Vector3d(0.0, 0.0, gravity_) - state.Attitude() * unmodelled_f_B_;
    thrust_E.z() = std::min(thrust_E.z(), -0.2 * gravity_);
    const double sideways = thrust_E.head<2>().norm();
    const double allowed = -thrust_E.z() * std::tan(config_.max_tilt);
    if (sideways > allowed) thrust_E.head<2>() *= allowed / sideways;
    return thrust_E;
  }
  Vector3d WantedRate(const Quaterniond& q_E_B, const Quaterniond& wanted,
                      const PathPoint& ahead) const {
    return config_.attitude_gain.cwiseProduct(SmallTurn(q_E_B.conjugate() * wanted)) +
           q_E_B.conjugate() * Vector3d(0.0, 0.0, ahead.heading_rate);
  }

  VehicleConfig vehicle_;
  AutopilotConfig config_;
  double gravity_;
  Eigen::Matrix<double, 4, Eigen::Dynamic> allocation_;  // squared speeds -> wrench
  Eigen::MatrixXd inverse_allocation_;
  Vector3d unmodelled_f_B_ = Vector3d::Zero();   // m/s^2
  Vector3d unmodelled_dw_B_ = Vector3d::Zero();  // rad/s^2
};

}  // namespace trueline::simulation
