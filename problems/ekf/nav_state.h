// The filter's 15 states (Li et al. 2019, eq. 17) and the definition of their errors.
//
// Errors are in the order p, v, attitude, b_a, b_g. The attitude error is either an addition to the
// Euler angles Phi_E_I (eq. 17), or a rotation vector in I on the right of q_E_I (error state on
// the rotation group).
#pragma once

#include "cost_functions/models/kinematic_model.h"
#include "problems/ekf/ekf_options.h"

namespace trueline {

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

// Propagation of the filter's covariance (Li et al. 2019, eq. 24-25).

// F P F' with the transition's blocks of zero and identity left out; about a quarter of the
// dense product's operations.
Matrix15d Propagate(const Transition& F, const Matrix15d& P);

// Covariance that white noise of accelerometer and gyroscope and random walks of the biases add
// over the step: the integral of exp(A s) G S G' exp(A s)' ds, to the leading order of each block.
Matrix15d StepNoise(const Transition& F, const ImuNoise& noise);

// The paper's Q: constant variances for each sample at its rate, for any dt.
Matrix15d PaperStepNoise(const EkfOptions& options, double dt);

}  // namespace trueline
