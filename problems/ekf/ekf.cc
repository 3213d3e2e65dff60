#include "problems/ekf/ekf.h"

#include <Eigen/Dense>

namespace trueline {

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
