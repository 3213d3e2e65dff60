// The residual of one gate fix against the trajectory of the kinematic model.
//
//   prediction: p(t_i) by eq. 37 (Li et al. 2019), integrated from the window's start
//   error:      p(t_i) - fix, in m (the bracket of eq. 29)
//   weighting:  divided by the detector's sigma, the same for each axis
//   unknowns:   theta (b_a, b_g, Phi_E_Ep at the start; in units of their prior sigmas) and state
//               (p in m, v in m/s at the start)
//
// An EvaluationCallback integrates once for each evaluation point; this residual only reads its
// node.
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace trueline {

inline constexpr int kKinematicThetaSize = 9;
inline constexpr int kKinematicStateSize = 6;

// Position and velocity at one instant with their derivatives to the scaled unknowns.
struct KinematicNode {
  Eigen::Matrix<double, 6, 1> value = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, kKinematicThetaSize> d_theta =
      Eigen::Matrix<double, 6, kKinematicThetaSize>::Zero();
  double elapsed = 0.0;  // s since the start: the start's velocity adds elapsed * v to p

  Eigen::Matrix<double, 6, 6> d_state() const {
    Eigen::Matrix<double, 6, 6> d = Eigen::Matrix<double, 6, 6>::Identity();
    d.topRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * elapsed;
    return d;
  }
};

class KinematicFixResidual
    : public ceres::SizedCostFunction<3, kKinematicThetaSize, kKinematicStateSize> {
 public:
  // `node` must outlive the problem. sigma in m.
  KinematicFixResidual(const KinematicNode* node, const Eigen::Vector3d& fix_E, double sigma)
      : node_(node), fix_E_(fix_E), weight_(1.0 / sigma) {}

  bool Evaluate(double const* const* /*parameters*/, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d> r(residuals);
    r = weight_ * (node_->value.head<3>() - fix_E_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, kKinematicThetaSize, Eigen::RowMajor>> J(jacobians[0]);
      J = weight_ * node_->d_theta.topRows<3>();
    }
    if (jacobians != nullptr && jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, kKinematicStateSize, Eigen::RowMajor>> J(jacobians[1]);
      J = weight_ * node_->d_state().topRows<3>();
    }
    return r.allFinite();
  }

 private:
  const KinematicNode* node_;
  Eigen::Vector3d fix_E_;
  double weight_;
};

}  // namespace trueline
