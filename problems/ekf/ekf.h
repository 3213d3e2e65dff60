// The classic 15-state extended Kalman filter (Li et al. 2019, eq. 17-27): predicts at the IMU's
// rate, corrects with position fixes.
#pragma once

#include "problems/ekf/nav_state.h"

namespace trueline {

class Ekf {
 public:
  // gravity in m/s^2.
  Ekf(const EkfOptions& options, double gravity);

  // `cov` is of the errors defined in nav_state.h.
  void Start(const NavState& x, const Matrix15d& cov);

  // One step over dt seconds (eq. 23-25).
  void Predict(const ImuInput& imu, double dt);

  // One fix (eq. 26-27), sigma in m for each axis; false if the gate rejects it.
  bool Update(const Eigen::Vector3d& fix_E, double sigma);

  // The covariance at the start, with the given state, by the options' tuning.
  Matrix15d StartCovariance(const NavState& x) const;

  // Replaces the state but not the covariance; for re-linearisation.
  void SetState(const NavState& x) { x_ = x; }
  // Starts to accumulate the product of all transitions.
  void RecordTransitions();
  void StopRecording() { recording_ = false; }
  const Matrix15d& recorded_transitions() const { return recorded_; }

  const NavState& state() const { return x_; }
  const Matrix15d& cov() const { return P_; }
  // Innovation of a fix against the present state (m), and its covariance (m^2).
  Eigen::Vector3d Innovation(const Eigen::Vector3d& fix_E) const { return fix_E - x_.motion.p; }
  Eigen::Matrix3d InnovationCovariance(double sigma) const;
  // Normalised innovation squared of the last Update: chi-square with three degrees of freedom.
  double last_nis() const { return last_nis_; }

 private:
  bool Refuses(double nis);
  void Correct(const Eigen::Vector3d& innovation, const Eigen::Matrix3d& S, double sigma);

  EkfOptions options_;
  double gravity_;
  NavState x_;
  Matrix15d P_ = Matrix15d::Identity();
  bool recording_ = false;
  Matrix15d recorded_ = Matrix15d::Identity();
  double last_nis_ = 0.0;
  int refusals_ = 0;  // in a row
};

}  // namespace trueline
