// The least-squares problem of one window under the kinematic model (eq. 28-30 with eq. 37-38 of
// Li et al. 2019): biases and start from fixes.
#pragma once

#include <ceres/ceres.h>

#include <span>
#include <vector>

#include "cost_functions/kinematic_fix_residual.h"
#include "problems/vgd/kinematic_chain.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

class KinematicWindow : private ceres::EvaluationCallback {
 public:
  using Theta = Eigen::Matrix<double, kKinematicThetaSize, 1>;
  using State = Eigen::Matrix<double, kKinematicStateSize, 1>;
  static constexpr int kAsked = kKinematicThetaSize + kKinematicStateSize;

  // From the first fix to `end`. Loss, whitening, solver and use of the ranges are `vgd`'s. The
  // track gives the AHRS's attitude at the start.
  KinematicWindow(const ImuInputs& imu, std::span<const Fix> fixes, TimeNs end,
                  const VgdOptions& vgd, const KinematicOptions& options);
  KinematicWindow(const KinematicWindow&) = delete;
  KinematicWindow& operator=(const KinematicWindow&) = delete;

  // Where the search begins: theta in its own units, p and v at the window's start.
  void SetStart(const Theta& theta, const State& state);
  ceres::Solver::Summary Solve();

  // b_a (m/s^2), b_g (rad/s), Phi_E_Ep at the start (rad).
  Theta Parameters() const { return sigma_.cwiseProduct(theta_); }
  const Theta& prior_sigma() const { return sigma_; }
  // How many of the parameters are free: six without the initial attitude.
  int free_parameters() const {
    return options_.initial_attitude ? kKinematicThetaSize : kImuBiasSize;
  }

  // Covariance of (theta in units of its prior sigmas, p and v at the end): the fixes' part by the
  // Gauss-Newton Hessian, and the effect of IMU noise on the path, within the fit and after it.
  Eigen::Matrix<double, kAsked, kAsked> Covariance();

  // p and v (in E) at each of times().
  const std::vector<KinematicNode>& nodes() const { return nodes_; }
  const std::vector<TimeNs>& times() const { return chain_.times(); }
  Eigen::Vector3d PositionAt(TimeNs t) const;

 private:
  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;
  void Refresh(bool derivatives);
  template <typename T>
  void Integrate(const Eigen::Matrix<T, kKinematicThetaSize, 1>& theta);
  void AddResiduals(std::span<const Fix> fixes);
  void AddPriors();
  std::size_t IndexOf(TimeNs t) const;
  Eigen::MatrixXd FitDeviations(const Eigen::MatrixXd& J, const Eigen::MatrixXd& gain) const;

  VgdOptions vgd_;
  KinematicOptions options_;
  KinematicChain chain_;
  double gravity_;
  Eigen::Quaterniond q_Ep_I_;  // at the window's start
  Theta sigma_;
  Theta theta_ = Theta::Zero();  // in prior sigmas
  State state_ = State::Zero();
  std::vector<KinematicNode> nodes_;
  ceres::Problem problem_;
  std::vector<std::size_t> fix_nodes_;  // by fix
};

}  // namespace trueline
