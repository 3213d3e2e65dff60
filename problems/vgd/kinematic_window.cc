#include "problems/vgd/kinematic_window.h"

#include <ceres/jet.h>
#include <ceres/normal_prior.h>
#include <glog/logging.h>

#include <algorithm>

#include "problems/vgd/kinematic_chain.h"
#include "problems/vgd/solver_options.h"
#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

using ThetaJet = ceres::Jet<double, kKinematicThetaSize>;

// Times of all fixes and the end, and points every 0.1 s for noise and trajectory.
std::vector<TimeNs> TimesOf(std::span<const Fix> fixes, TimeNs end) {
  constexpr TimeNs kSpacing = kNsPerSecond / 10;
  std::vector<TimeNs> times;
  for (const Fix& fix : fixes) times.push_back(fix.t);
  for (TimeNs t = times.front(); t < end; t += kSpacing) times.push_back(t);
  times.push_back(end);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

void Store(const KinematicState<double>& x, KinematicNode* node) { node->value << x.p, x.v; }

void Store(const KinematicState<ThetaJet>& x, KinematicNode* node) {
  for (int i = 0; i < 3; ++i) {
    node->value[i] = x.p[i].a;
    node->value[i + 3] = x.v[i].a;
    node->d_theta.row(i) = x.p[i].v.transpose();
    node->d_theta.row(i + 3) = x.v[i].v.transpose();
  }
}

}  // namespace

KinematicWindow::KinematicWindow(const ImuInputs& imu, std::span<const Fix> fixes, TimeNs end,
                                 const VgdOptions& vgd, const KinematicOptions& options)
    : vgd_(vgd),
      options_(options),
      chain_(imu, fixes.front().t, TimesOf(fixes, end), vgd.max_block),
      gravity_(imu.track().gravity()),
      q_Ep_I_(imu.AhrsAttitudeAt(fixes.front().t)),
      nodes_(chain_.times().size()),
      problem_(ProblemOptions(this)) {
  sigma_ << Eigen::Vector3d::Constant(options.accel_bias_sigma),
      Eigen::Vector3d::Constant(options.gyro_bias_sigma), options.tilt_sigma, options.tilt_sigma,
      options.heading_sigma;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i].elapsed = SecondsBetween(chain_.start(), chain_.times()[i]);
  }
  AddResiduals(fixes);
}

std::size_t KinematicWindow::IndexOf(TimeNs t) const {
  const auto it = std::lower_bound(times().begin(), times().end(), t);
  CHECK(it != times().end() && *it == t) << "the window has no node at that time";
  return static_cast<std::size_t>(it - times().begin());
}

void KinematicWindow::AddResiduals(std::span<const Fix> fixes) {
  problem_.AddParameterBlock(theta_.data(), kKinematicThetaSize);
  problem_.AddParameterBlock(state_.data(), kKinematicStateSize);
  for (const Fix& fix : fixes) {
    const double sigma = vgd_.whiten ? fix.sigma : 1.0;
    fix_nodes_.push_back(IndexOf(fix.t));
    problem_.AddResidualBlock(new KinematicFixResidual(&nodes_[fix_nodes_.back()], fix.p_E, sigma),
                              MakeLoss(vgd_.loss, vgd_.loss_scale), theta_.data(), state_.data());
  }
  AddPriors();
}

void KinematicWindow::AddPriors() {
  constexpr int kSize = kKinematicThetaSize;
  if (vgd_.ranges == RangeUse::kPrior) {
    problem_.AddResidualBlock(
        new ceres::NormalPrior(Eigen::MatrixXd::Identity(kSize, kSize), Theta::Zero()), nullptr,
        theta_.data());
  }
  if (!options_.initial_attitude) {
    std::vector<int> attitude;
    for (int i = kImuBiasSize; i < kSize; ++i) attitude.push_back(i);
    problem_.SetManifold(theta_.data(), new ceres::SubsetManifold(kSize, attitude));
  }
  if (!vgd_.HasBounds()) return;
  for (int i = 0; i < kKinematicThetaSize; ++i) {
    problem_.SetParameterLowerBound(theta_.data(), i, -KinematicOptions::kBoundSigmas);
    problem_.SetParameterUpperBound(theta_.data(), i, KinematicOptions::kBoundSigmas);
  }
}

void KinematicWindow::SetStart(const Theta& theta, const State& state) {
  theta_ = theta.cwiseQuotient(sigma_);
  state_ = state;
}

template <typename T>
void KinematicWindow::Integrate(const Eigen::Matrix<T, kKinematicThetaSize, 1>& theta) {
  ImuBias<T> bias;
  bias.accel = theta.template head<3>();
  bias.gyro = theta.template segment<3>(3);
  KinematicState<T> x;
  x.p = state_.head<3>().cast<T>();
  x.v = state_.tail<3>().cast<T>();
  const Vector3<T> Phi_E_Ep = theta.template tail<3>();
  x.q_E_I = QuaternionFromEuler<T>(Phi_E_Ep) * q_Ep_I_.cast<T>();
  chain_.Integrate(bias, x,
                   [&](std::size_t i, const KinematicState<T>& at) { Store(at, &nodes_[i]); });
}

void KinematicWindow::Refresh(bool derivatives) {
  const Theta theta = Parameters();
  if (!derivatives) return Integrate<double>(theta);
  Eigen::Matrix<ThetaJet, kKinematicThetaSize, 1> jets;
  for (int i = 0; i < kKinematicThetaSize; ++i) {
    jets[i] = ThetaJet(theta[i]);
    jets[i].v[i] = sigma_[i];
  }
  Integrate<ThetaJet>(jets);
}

void KinematicWindow::PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) {
  if (new_evaluation_point || evaluate_jacobians) Refresh(evaluate_jacobians);
}

ceres::Solver::Summary KinematicWindow::Solve() {
  ceres::Solver::Summary summary;
  ceres::Solve(SolverOptions(vgd_, ceres::DENSE_QR), &problem_, &summary);
  Refresh(true);
  return summary;
}

// Errors of the requested quantities by unit noises of the IMU (columns): the path's deviations act
// through the fit's gain, and directly at the window's end. J: whitened Jacobian, the fixes' rows
// first.
Eigen::MatrixXd KinematicWindow::FitDeviations(const Eigen::MatrixXd& J,
                                               const Eigen::MatrixXd& gain) const {
  const Eigen::MatrixXd path = PathDeviations(nodes_, options_.noise, gravity_);
  const int first_state = static_cast<int>(J.cols()) - kKinematicStateSize;
  Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(kAsked, path.cols());
  for (std::size_t i = 0; i < fix_nodes_.size(); ++i) {
    const int row = static_cast<int>(3 * i), node = static_cast<int>(6 * fix_nodes_[i]);
    // The start position adds to every fix: its columns are the fix's weights, robust loss
    // included.
    const Eigen::Matrix3d weight = J.block<3, 3>(row, first_state);
    errors += gain.middleCols<3>(row) * weight * path.middleRows<3>(node);
  }
  errors.bottomRows<6>() -= path.bottomRows<6>();
  return errors;
}

Eigen::Matrix<double, KinematicWindow::kAsked, KinematicWindow::kAsked>
KinematicWindow::Covariance() {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = {theta_.data(), state_.data()};
  ceres::CRSMatrix crs;
  problem_.Evaluate(options, nullptr, nullptr, nullptr, &crs);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(crs.num_rows, crs.num_cols);
  for (int row = 0; row < crs.num_rows; ++row) {
    for (int k = crs.rows[row]; k < crs.rows[row + 1]; ++k) J(row, crs.cols[k]) = crs.values[k];
  }
  const int free = free_parameters();
  Eigen::MatrixXd H = J.transpose() * J;
  if (vgd_.ranges != RangeUse::kPrior) {
    const double weight = WindowProblem::PriorWeight(vgd_);
    H.diagonal().head(free).array() += weight * weight;
  }
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(free + kKinematicStateSize, kAsked);
  G.topLeftCorner(free, free).setIdentity();
  const KinematicNode& end = nodes_.back();
  G.topRightCorner(free, 6) = end.d_theta.leftCols(free).transpose();
  G.bottomRightCorner<6, 6>() = end.d_state().transpose();
  // Full rank: priors hold theta (very wide ones where the fit has none), and two fixes apart in
  // time hold p and v.
  const Eigen::MatrixXd inverse_G = H.completeOrthogonalDecomposition().solve(G);
  const Eigen::MatrixXd bent = FitDeviations(J, inverse_G.transpose() * J.transpose());
  return G.transpose() * inverse_G + bent * bent.transpose();
}

Eigen::Vector3d KinematicWindow::PositionAt(TimeNs t) const {
  return nodes_[IndexOf(t)].value.head<3>();
}

}  // namespace trueline
