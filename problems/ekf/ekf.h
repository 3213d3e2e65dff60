// The classic 15-state extended Kalman filter (Li et al. 2019, eq. 17-27): predicts at the IMU's
// rate, corrects with position fixes.
#pragma once

#include <array>

#include "cost_functions/models/kinematic_model.h"
#include "problems/common/yaml_archive.h"
#include "problems/log/flight_log.h"
#include "problems/result/estimate.h"
#include "problems/vgd/drive_track.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Options of the Kalman filter. Defaults are stated only here; the YAML keys are in the mapping
// `ekf` and carry the units.

enum class EkfTuning { kConsistent, kPaper };
enum class AttitudeForm { kEuler, kErrorState };
enum class EkfGating { kNone, kChiSquare };

// Initial sigmas for each axis. Biases: the uniform ranges of Table 2 of Li et al. 2019 (width over
// sqrt(12)).
struct EkfStart {
  double position = 5.0;     // m, around a line through the first pass's fixes
  double velocity = 5.0;     // m/s, around that line
  double tilt = 0.040;       // rad, around the AHRS
  double heading = 0.031;    // rad, around the AHRS
  double accel_bias = 0.58;  // m/s^2
  double gyro_bias = 0.030;  // rad/s
};

struct EkfOptions {
  EkfTuning tuning = EkfTuning::kConsistent;
  AttitudeForm attitude = AttitudeForm::kErrorState;
  EkfGating gating = EkfGating::kChiSquare;
  // Fixes with a larger squared Mahalanobis distance are rejected; 16.27 is chi-square's 99.9 % for
  // three degrees of freedom.
  double gate = 16.27;
  // After this many rejections in a row the estimate counts as lost, and the next fix is accepted.
  int max_refusals = 5;
  // Repeats prediction and update across a blind arc around the smoothed state at its start
  // (iterated filter-smoother). A fix is a linear function of the state, so iterating the update
  // alone would change nothing.
  bool iterated = false;

  ImuNoise noise;
  bool gyro_from_log = true;  // whether gyro_scatter is measured on the log, or stays zero
  EkfStart start;

  // The paper's tuning: P0 = 10 I, R = 2.5^2 m^2 for every fix, and Q added at every IMU sample. Q
  // is misprinted in the attitude entries; 3e-8, 3e-9, 3e-9 is the reading that gives 15 entries.
  // Variances for each sample at 512 Hz of p (m^2), v (m^2/s^2), Phi (rad^2).
  std::array<double, 9> paper_q = {2e-6, 2e-6, 5e-6, 1e-5, 5e-6, 3e-5, 3e-8, 3e-9, 3e-9};
  // Of p (m^2), v (m^2/s^2), Phi (rad^2), b_a (m^2/s^4), b_g (rad^2/s^2), the same for three axes.
  std::array<double, 5> paper_p0 = {10.0, 10.0, 10.0, 10.0, 10.0};
  double paper_fix_sigma = 2.5;  // m
  double paper_rate = 512.0;     // Hz
};

void Serialize(YamlArchive* a, EkfOptions* o);

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

// The filter over a whole flight, beside the window estimators. The update with the first fix
// after an arc is where linearisation matters most.

// Predicts `filter` with the IMU from t0 to t1.
void PredictOver(const ImuInputs& imu, TimeNs t0, TimeNs t1, Ekf* filter);

// Predicts from t0 to the fix and updates, iterated: the fix is smoothed back to t0 and the
// prediction repeated, linearised at the smoothed state, until convergence (the iterated linear
// filter-smoother; Jazwinski 1970, section 8.3). False if the gate rejects the fix.
bool IteratedArcUpdate(const ImuInputs& imu, AttitudeForm form, TimeNs t0, const Fix& fix,
                       Ekf* filter);

// Runs causally over the log's passes. The estimate at the end of pass tau is "window" tau, whose
// arc is predicted with the IMU alone. Fixes within the arc (withheld, of a flight without gates)
// are used after that, from the arc's start on. The filter has no windows: `gamma` is only stored
// in the result. If an arc has a gap or is too long, position, velocity and attitude are
// initialised again at the next pass; the biases are kept.
EstimatorRun RunEkf(const FlightData& flight, const EkfOptions& options, int gamma);

// The initial state at pass `pass`: a line through its fixes, the AHRS's attitude, zero biases.
NavState StartOfPass(const FlightData& flight, const ImuInputs& imu, const Pass& pass);

}  // namespace trueline
