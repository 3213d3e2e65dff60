// The classic 15-state extended Kalman filter (Li et al. 2019, eq. 17-27): predicts at the IMU's
// rate, corrects with position fixes.
#pragma once

#include "cost_functions/models/kinematic_model.h"
#include "problems/ekf/ekf_options.h"

namespace trueline {

// Errors of the 15 states (eq. 17) are in the order p, v, attitude, b_a, b_g. The attitude error is
// either an addition to the Euler angles Phi_E_I (eq. 17), or a rotation vector in I on the right
// of q_E_I (error state on the rotation group).
inline constexpr int kNavSize = 15;
using Vector15d = Eigen::Matrix<double, kNavSize, 1>;
using Matrix15d = Eigen::Matrix<double, kNavSize, kNavSize>;

struct NavState {
  KinematicState<double> motion;
  ImuBias<double> bias;
};

// The derivative of one step's (p, v, attitude) by the (attitude, b_a, b_g) before it. The rest of
// the 15 x 15 transition is known: identity, and dt from v to p.
struct Transition {
  double dt = 0.0;  // s
  Eigen::Matrix<double, 9, 9> tail = Eigen::Matrix<double, 9, 9>::Zero();

  Matrix15d Dense() const;
};

// One step of eq. 37 and its derivatives, by automatic differentiation of the one model.
NavState Advance(AttitudeForm form, const NavState& x, const ImuInput& imu, double gravity,
                 double dt, Transition* transition);

// x moved by an error.
NavState Moved(AttitudeForm form, const NavState& x, const Vector15d& error);

// Derivative of the attitude error of `form` by a small rotation vector in E: converts an
// uncertainty of tilt and heading to the filter's errors.
Eigen::Matrix3d AttitudeErrorFromEarth(AttitudeForm form, const NavState& x);

// Propagation of the filter's covariance (eq. 24-25): F P F' with the transition's blocks of zero
// and identity left out; about a quarter of the dense product's operations.
Matrix15d Propagate(const Transition& F, const Matrix15d& P);

// Covariance that white noise of accelerometer and gyroscope and random walks of the biases add
// over the step: the integral of exp(A s) G S G' exp(A s)' ds, to the leading order of each block.
Matrix15d StepNoise(const Transition& F, const ImuNoise& noise);

// The paper's Q: constant variances for each sample at its rate, for any dt.
Matrix15d PaperStepNoise(const EkfOptions& options, double dt);

class Ekf {
 public:
  // gravity in m/s^2.
  Ekf(const EkfOptions& options, double gravity);

  // `cov` is of the states' errors.
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
