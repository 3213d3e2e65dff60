#include "problems/kinematic/kinematic_window.h"

#include <ceres/jet.h>
#include <ceres/normal_prior.h>
#include <glog/logging.h>

#include <algorithm>

#include "problems/vgd/fix_loss.h"

namespace trueline {
namespace {

using Jet = ceres::Jet<double, kKinematicThetaSize>;

ceres::Problem::Options ProblemOptions(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.evaluation_callback = callback;
  return options;
}

// Times of all fixes, points every 1/30 s for the trajectory behind the last one, and the end.
std::vector<TimeNs> TimesOf(std::span<const Fix> fixes, TimeNs end) {
  constexpr TimeNs kSpacing = kNsPerSecond / 30;
  std::vector<TimeNs> times;
  for (const Fix& fix : fixes) times.push_back(fix.t);
  for (TimeNs t = times.back() + kSpacing; t < end; t += kSpacing) times.push_back(t);
  times.push_back(end);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

void Store(const KinematicState<double>& x, KinematicNode* node) { node->value << x.p, x.v; }

void Store(const KinematicState<Jet>& x, KinematicNode* node) {
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
    fix_blocks_.push_back(problem_.AddResidualBlock(
        new KinematicFixResidual(&nodes_[IndexOf(fix.t)], fix.p_E, sigma),
        MakeLoss(vgd_.loss, vgd_.loss_scale), theta_.data(), state_.data()));
  }
  problem_.AddResidualBlock(new ceres::NormalPrior(Eigen::MatrixXd::Identity(9, 9), Theta::Zero()),
                            nullptr, theta_.data());
  if (!options_.initial_attitude) {
    problem_.SetManifold(theta_.data(), new ceres::SubsetManifold(9, {6, 7, 8}));
  }
  if (vgd_.solver == VgdSolver::kGradientDescent) return;  // line search knows no bounds
  for (int i = 0; i < kKinematicThetaSize; ++i) {
    problem_.SetParameterLowerBound(theta_.data(), i, -options_.bound_sigmas);
    problem_.SetParameterUpperBound(theta_.data(), i, options_.bound_sigmas);
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
  Eigen::Matrix<Jet, kKinematicThetaSize, 1> jets;
  for (int i = 0; i < kKinematicThetaSize; ++i) {
    jets[i] = Jet(theta[i]);
    jets[i].v[i] = sigma_[i];
  }
  Integrate<Jet>(jets);
}

void KinematicWindow::PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) {
  if (new_evaluation_point || evaluate_jacobians) Refresh(evaluate_jacobians);
}

ceres::Solver::Summary KinematicWindow::Solve() {
  ceres::Solver::Options options;
  options.max_num_iterations = vgd_.max_iterations;
  options.function_tolerance = vgd_.tolerance;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  if (vgd_.solver == VgdSolver::kGradientDescent) {
    options.minimizer_type = ceres::LINE_SEARCH;
    options.line_search_direction_type = ceres::STEEPEST_DESCENT;
  } else {
    options.linear_solver_type = ceres::DENSE_QR;
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  Refresh(true);
  return summary;
}

// Chi-square of the fixes for each degree of freedom, not below 1: rigid integration cannot follow
// what IMU noise and a poor gyroscope do, and says so only by its misfit.
double KinematicWindow::VarianceFactor() {
  ceres::Problem::EvaluateOptions options;
  options.residual_blocks = fix_blocks_;
  double cost = 0.0;
  problem_.Evaluate(options, &cost, nullptr, nullptr, nullptr);
  const double freedom =
      std::max(3.0 * fix_blocks_.size() - free_parameters() - kKinematicStateSize, 1.0);
  return std::max(1.0, 2.0 * cost / freedom);
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
  const Eigen::MatrixXd H = J.transpose() * J;
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(free + kKinematicStateSize, kAsked);
  G.topLeftCorner(free, free).setIdentity();
  const KinematicNode& end = nodes_.back();
  G.topRightCorner(free, 6) = end.d_theta.leftCols(free).transpose();
  G.bottomRightCorner<6, 6>() = end.d_state().transpose();
  // Full rank: priors hold theta, and two fixes apart in time hold p and v.
  const Eigen::MatrixXd inverse_G = H.completeOrthogonalDecomposition().solve(G);
  return VarianceFactor() * G.transpose() * inverse_G;
}

Eigen::Vector3d KinematicWindow::PositionAt(TimeNs t) const {
  return nodes_[IndexOf(t)].value.head<3>();
}

}  // namespace trueline
