#include "problems/ekf/ekf.h"

#include <ceres/jet.h>

#include <Eigen/Dense>

#include "cost_functions/models/rotation.h"

namespace trueline {
namespace {

constexpr int kSeeds = 9;  // attitude, b_a, b_g
using NavJet = ceres::Jet<double, kSeeds>;

Vector3<NavJet> Seeded(const Eigen::Vector3d& value, int first) {
  return {NavJet(value[0], first), NavJet(value[1], first + 1), NavJet(value[2], first + 2)};
}

Eigen::Vector3d ValueOf(const Vector3<NavJet>& x) { return {x[0].a, x[1].a, x[2].a}; }

void StoreRows(const Vector3<NavJet>& x, int first_row, Transition* transition) {
  for (int i = 0; i < 3; ++i) transition->tail.row(first_row + i) = x[i].v.transpose();
}

template <class State>
void StoreMotion(const State& x, NavState* next, Transition* transition) {
  next->motion.p = ValueOf(x.p);
  next->motion.v = ValueOf(x.v);
  StoreRows(x.p, 0, transition);
  StoreRows(x.v, 3, transition);
}

ImuBias<NavJet> SeededBias(const NavState& x) {
  return {Seeded(x.bias.accel, 3), Seeded(x.bias.gyro, 6)};
}

NavState AdvanceErrorState(const NavState& x, const ImuInput& imu, double gravity, double dt,
                           Transition* transition) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  KinematicState<NavJet> motion;
  motion.p = x.motion.p.cast<NavJet>();
  motion.v = x.motion.v.cast<NavJet>();
  motion.q_E_I =
      x.motion.q_E_I.cast<NavJet>() * RotationFromHalfVector<NavJet>(Seeded(zero, 0) * NavJet(0.5));
  KinematicStep(imu, SeededBias(x), gravity, dt, &motion);

  NavState next = x;
  StoreMotion(motion, &next, transition);
  const Eigen::Quaternion<NavJet>& q = motion.q_E_I;
  next.motion.q_E_I = Eigen::Quaterniond(q.w().a, q.x().a, q.y().a, q.z().a).normalized();
  // Twice the vector part of the small rotation between the new nominal attitude and q.
  const Eigen::Quaternion<NavJet> error = next.motion.q_E_I.conjugate().cast<NavJet>() * q;
  StoreRows(error.vec() * NavJet(2.0), 6, transition);
  return next;
}

NavState AdvanceEuler(const NavState& x, const ImuInput& imu, double gravity, double dt,
                      Transition* transition) {
  EulerKinematicState<NavJet> motion;
  motion.p = x.motion.p.cast<NavJet>();
  motion.v = x.motion.v.cast<NavJet>();
  motion.Phi = Seeded(EulerFromQuaternion(x.motion.q_E_I), 0);
  KinematicStep(imu, SeededBias(x), gravity, dt, &motion);

  NavState next = x;
  StoreMotion(motion, &next, transition);
  next.motion.q_E_I = QuaternionFromEuler(ValueOf(motion.Phi));
  StoreRows(motion.Phi, 6, transition);
  return next;
}

}  // namespace

Matrix15d Transition::Dense() const {
  Matrix15d F = Matrix15d::Identity();
  F.block<3, 3>(0, 3) = Eigen::Matrix3d::Identity() * dt;
  F.block<9, 9>(0, 6) = tail;
  return F;
}

NavState Advance(AttitudeForm form, const NavState& x, const ImuInput& imu, double gravity,
                 double dt, Transition* transition) {
  transition->dt = dt;
  return form == AttitudeForm::kEuler ? AdvanceEuler(x, imu, gravity, dt, transition)
                                      : AdvanceErrorState(x, imu, gravity, dt, transition);
}

NavState Moved(AttitudeForm form, const NavState& x, const Vector15d& error) {
  NavState moved = x;
  moved.motion.p += error.segment<3>(0);
  moved.motion.v += error.segment<3>(3);
  moved.bias.accel += error.segment<3>(9);
  moved.bias.gyro += error.segment<3>(12);
  const Eigen::Vector3d turn = error.segment<3>(6);
  if (form == AttitudeForm::kEuler) {
    moved.motion.q_E_I = QuaternionFromEuler<double>(EulerFromQuaternion(x.motion.q_E_I) + turn);
  } else {
    moved.motion.q_E_I = (x.motion.q_E_I * RotationByVector(turn)).normalized();
  }
  return moved;
}

Eigen::Matrix3d AttitudeErrorFromEarth(AttitudeForm form, const NavState& x) {
  Eigen::Matrix3d R_I_E = x.motion.q_E_I.conjugate().toRotationMatrix();
  if (form == AttitudeForm::kErrorState) return R_I_E;
  return EulerRateFromBodyRate<double>(EulerFromQuaternion(x.motion.q_E_I)) * R_I_E;
}

namespace {

constexpr int kV = 3, kAttitude = 6, kBa = 9, kBg = 12;

}  // namespace

Matrix15d Propagate(const Transition& F, const Matrix15d& P) {
  const auto to_p = F.tail.topRows<3>(), to_v = F.tail.middleRows<3>(3);
  const auto turn = F.tail.block<3, 3>(6, 0), turn_bg = F.tail.block<3, 3>(6, 6);
  // The upper nine rows of F P: biases stay, so the lower six rows are those of P.
  const Eigen::Matrix<double, 9, kNavSize> P_tail = P.bottomRows<9>();
  Eigen::Matrix<double, 9, kNavSize> M;
  M.topRows<3>().noalias() = P.topRows<3>() + F.dt * P.middleRows<3>(kV);
  M.topRows<3>().noalias() += to_p.lazyProduct(P_tail);
  M.middleRows<3>(3).noalias() = P.middleRows<3>(kV) + to_v.lazyProduct(P_tail);
  M.bottomRows<3>().noalias() = turn.lazyProduct(P_tail.topRows<3>());
  M.bottomRows<3>().noalias() += turn_bg.lazyProduct(P_tail.bottomRows<3>());

  Matrix15d next;
  const Eigen::Matrix<double, 9, 9> M_tail = M.rightCols<9>();
  next.block<9, 3>(0, 0).noalias() = M.leftCols<3>() + F.dt * M.middleCols<3>(kV);
  next.block<9, 3>(0, 0).noalias() += M_tail.lazyProduct(to_p.transpose());
  next.block<9, 3>(0, kV).noalias() = M.middleCols<3>(kV) + M_tail.lazyProduct(to_v.transpose());
  next.block<9, 3>(0, kAttitude).noalias() = M_tail.leftCols<3>().lazyProduct(turn.transpose());
  next.block<9, 3>(0, kAttitude).noalias() +=
      M_tail.rightCols<3>().lazyProduct(turn_bg.transpose());
  next.block<9, 6>(0, kBa) = M.rightCols<6>();
  next.block<6, 9>(kBa, 0) = M.rightCols<6>().transpose();
  next.bottomRightCorner<6, 6>() = P.bottomRightCorner<6, 6>();
  return next;
}

// N, M and R are the derivatives of dPhi/dt by b_g and of dv/dt by Phi and b_a; the transition
// holds them times dt. The gyroscope's noise enters like its bias, through N.
Matrix15d StepNoise(const Transition& F, const ImuNoise& noise) {
  const double t = F.dt;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d M = F.tail.block<3, 3>(3, 0) / t;
  const Eigen::Matrix3d R = F.tail.block<3, 3>(3, 3) / t;
  const Eigen::Matrix3d N = F.tail.block<3, 3>(6, 6) / t;
  const double s_a = noise.accel * noise.accel;
  const Eigen::Vector3d s_g = noise.GyroSpectrum();
  const double s_ba = noise.accel_walk * noise.accel_walk;
  const double s_bg = noise.gyro_walk * noise.gyro_walk;
  const double t2 = t * t / 2.0, t3 = t * t * t / 6.0;
  const Eigen::Matrix3d turn = N * s_g.asDiagonal() * N.transpose();

  Matrix15d Q = Matrix15d::Zero();
  Q.block<3, 3>(0, 0) = I * (s_a * 2.0 * t3);
  Q.block<3, 3>(0, kV) = I * (s_a * t2);
  Q.block<3, 3>(0, kAttitude) = M * turn * t3;
  Q.block<3, 3>(0, kBa) = R * (s_ba * t3);
  Q.block<3, 3>(kV, kV) = I * (s_a * t + s_ba * 2.0 * t3) + M * turn * M.transpose() * (2.0 * t3);
  Q.block<3, 3>(kV, kAttitude) = M * turn * t2;
  Q.block<3, 3>(kV, kBa) = R * (s_ba * t2);
  Q.block<3, 3>(kV, kBg) = M * N * (s_bg * t3);
  Q.block<3, 3>(kAttitude, kAttitude) = turn * t + N * N.transpose() * (s_bg * 2.0 * t3);
  Q.block<3, 3>(kAttitude, kBg) = N * (s_bg * t2);
  Q.block<3, 3>(kBa, kBa) = I * (s_ba * t);
  Q.block<3, 3>(kBg, kBg) = I * (s_bg * t);
  Q.triangularView<Eigen::StrictlyLower>() = Q.transpose();
  return Q;
}

Matrix15d PaperStepNoise(const EkfOptions& options, double dt) {
  Matrix15d Q = Matrix15d::Zero();
  for (int i = 0; i < 9; ++i) Q(i, i) = options.paper_q[i] * options.paper_rate * dt;
  return Q;
}

Ekf::Ekf(const EkfOptions& options, double gravity) : options_(options), gravity_(gravity) {}

void Ekf::Start(const NavState& x, const Matrix15d& cov) {
  x_ = x;
  P_ = cov;
  refusals_ = 0;
}

Matrix15d Ekf::StartCovariance(const NavState& x) const {
  if (options_.tuning == EkfTuning::kPaper) {
    Vector15d P0;
    for (int i = 0; i < kNavSize; ++i) P0[i] = options_.paper_p0[i / 3];
    return P0.asDiagonal();
  }
  const EkfStart& s = options_.start;
  Matrix15d P = Matrix15d::Zero();
  const auto set = [&](int first, double sigma) {
    P.block<3, 3>(first, first) = Eigen::Matrix3d::Identity() * (sigma * sigma);
  };
  set(0, s.position);
  set(3, s.velocity);
  set(9, s.accel_bias);
  set(12, s.gyro_bias);
  const Eigen::Matrix3d J = AttitudeErrorFromEarth(options_.attitude, x);
  const Eigen::Vector3d sigma(s.tilt, s.tilt, s.heading);
  P.block<3, 3>(6, 6) = J * sigma.cwiseAbs2().asDiagonal() * J.transpose();
  return P;
}

void Ekf::Predict(const ImuInput& imu, double dt) {
  Transition F;
  x_ = Advance(options_.attitude, x_, imu, gravity_, dt, &F);
  P_ = Propagate(F, P_);
  P_ += options_.tuning == EkfTuning::kPaper ? PaperStepNoise(options_, dt)
                                             : StepNoise(F, options_.noise);
  if (recording_) recorded_ = F.Dense() * recorded_;
}

void Ekf::RecordTransitions() {
  recording_ = true;
  recorded_.setIdentity();
}

Eigen::Matrix3d Ekf::InnovationCovariance(double sigma) const {
  const double used = options_.tuning == EkfTuning::kPaper ? options_.paper_fix_sigma : sigma;
  return P_.topLeftCorner<3, 3>() + Eigen::Matrix3d::Identity() * (used * used);
}

bool Ekf::Refuses(double nis) {
  const bool refused = options_.gating == EkfGating::kChiSquare && nis > options_.gate &&
                       refusals_ < options_.max_refusals;
  refusals_ = refused ? refusals_ + 1 : 0;
  return refused;
}

bool Ekf::Update(const Eigen::Vector3d& fix_E, double sigma) {
  const Eigen::Vector3d innovation = Innovation(fix_E);
  const Eigen::Matrix3d S = InnovationCovariance(sigma);
  last_nis_ = innovation.dot(S.llt().solve(innovation));
  if (Refuses(last_nis_)) return false;
  Correct(innovation, S, sigma);
  return true;
}

void Ekf::Correct(const Eigen::Vector3d& innovation, const Eigen::Matrix3d& S, double sigma) {
  const double used = options_.tuning == EkfTuning::kPaper ? options_.paper_fix_sigma : sigma;
  const Eigen::Matrix<double, 15, 3> PHt = P_.leftCols<3>();
  const Eigen::Matrix<double, 15, 3> K = S.llt().solve(PHt.transpose()).transpose();
  const Vector15d error = K * innovation;
  x_ = Moved(options_.attitude, x_, error);

  // Joseph form (eq. 27); I - K H differs from the identity in its first three columns only.
  Matrix15d I_KH = Matrix15d::Identity();
  I_KH.leftCols<3>() -= K;
  P_ = (I_KH * P_ * I_KH.transpose() + used * used * K * K.transpose()).eval();
  if (options_.attitude == AttitudeForm::kErrorState) {
    // From here on attitude errors refer to the updated frame I.
    const Eigen::Vector3d half_turn = 0.5 * error.segment<3>(6);
    const Eigen::Matrix3d G = Eigen::Matrix3d::Identity() - Skew<double>(half_turn);
    P_.middleRows<3>(6) = (G * P_.middleRows<3>(6)).eval();
    P_.middleCols<3>(6) = (P_.middleCols<3>(6) * G.transpose()).eval();
  }
  P_ = (0.5 * (P_ + P_.transpose())).eval();
}

}  // namespace trueline
