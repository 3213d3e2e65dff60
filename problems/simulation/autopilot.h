// Flies the drone along the path. It uses the true state, as the paper's flights did, which were
// controlled by motion capture. It measures unmodelled forces and compensates them (incremental
// inversion), so that effects change the log and not the course.
#pragma once

#include <Eigen/Core>

#include "problems/simulation/airframe.h"
#include "problems/simulation/course.h"

namespace trueline::simulation {

class Autopilot {
 public:
  Autopilot(const VehicleConfig& vehicle, const AutopilotConfig& config, double gravity);

  // Wanted rotor speeds (rad/s) for a state and its rate of change `now`. Place, speed and heading
  // are those of `position`; accelerations are those of `ahead`, the reference ahead by the
  // attitude's lag.
  RotorArray Command(double dt, const BodyState& state, const BodyRate& now,
                     const PathPoint& position, const PathPoint& ahead);
  // Attitude and rotor speeds for steady flight at the start.
  BodyState Trim(const PathPoint& start) const;

 private:
  Eigen::Vector4d NominalWrench(const RotorArray& rotors) const;  // N up, N m
  RotorArray SpeedsFor(const Eigen::Vector4d& wrench) const;
  void MeasureDisturbance(double dt, const BodyState& state, const BodyRate& now);
  Vector3d WantedThrust(const BodyState& state, const PathPoint& position,
                        const PathPoint& ahead) const;
  Vector3d WantedRate(const Quaterniond& q_E_B, const Quaterniond& wanted,
                      const PathPoint& ahead) const;

  VehicleConfig vehicle_;
  AutopilotConfig config_;
  double gravity_;
  Eigen::Matrix<double, 4, Eigen::Dynamic> allocation_;  // squared speeds -> wrench
  Eigen::MatrixXd inverse_allocation_;
  Vector3d unmodelled_f_B_ = Vector3d::Zero();   // m/s^2
  Vector3d unmodelled_dw_B_ = Vector3d::Zero();  // rad/s^2
};

}  // namespace trueline::simulation
