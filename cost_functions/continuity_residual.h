// The step from the end of one segment of a window to the start of the next, loosened by what the
// model does not hold: small unmodelled accelerations and a slowly drifting AHRS error.
//
//   prediction: (p, v) at the segment's end by integration, Phi_E_Ep unchanged
//   error:      the next segment's (p, v, Phi_E_Ep) less the prediction
//   weighting:  inverse Cholesky factor of the covariance that the two Wiener processes build up
#pragma once

#include <ceres/sized_cost_function.h>

#include "cost_functions/models/process_noise.h"
#include "cost_functions/segment_node.h"

namespace trueline {

class ContinuityResidual
    : public ceres::SizedCostFunction<9, kBodySize, kAhrsSize, kStateSize, kAhrsSize, kStateSize> {
 public:
  // sigma_ahrs: rad for each unit of the ahrs blocks. sqrt_information: L^-1 of the covariance of
  // (p, v, Phi_E_Ep) with cov = L L'.
  ContinuityResidual(const StateNode* end, const Eigen::Vector3d& sigma_ahrs,
                     const Matrix9d& sqrt_information)
      : end_(end), sigma_ahrs_(sigma_ahrs), sqrt_information_(sqrt_information) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> ahrs(parameters[1]), next_ahrs(parameters[3]);
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> next(parameters[4]);
    Eigen::Matrix<double, 9, 1> error;
    error << next - end_->value, sigma_ahrs_.cwiseProduct(next_ahrs - ahrs);
    Eigen::Map<Eigen::Matrix<double, 9, 1>> r(residuals);
    r = sqrt_information_ * error;
    if (jacobians != nullptr) WriteJacobians(jacobians);
    return r.allFinite();
  }

 private:
  template <int kCols>
  void Write(const Eigen::Matrix<double, 9, kCols>& d_error, double* jacobian) const {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, 9, kCols, Eigen::RowMajor>> J(jacobian);
    J = sqrt_information_ * d_error;
  }

  void WriteJacobians(double** jacobians) const {
    const Eigen::Matrix3d scale = sigma_ahrs_.asDiagonal();
    Eigen::Matrix<double, 9, kBodySize> d_body = Eigen::Matrix<double, 9, kBodySize>::Zero();
    Eigen::Matrix<double, 9, kAhrsSize> d_ahrs = Eigen::Matrix<double, 9, kAhrsSize>::Zero();
    Eigen::Matrix<double, 9, kStateSize> d_state = Eigen::Matrix<double, 9, kStateSize>::Zero();
    Eigen::Matrix<double, 9, kAhrsSize> d_next_ahrs = Eigen::Matrix<double, 9, kAhrsSize>::Zero();
    Eigen::Matrix<double, 9, kStateSize> d_next = Eigen::Matrix<double, 9, kStateSize>::Zero();
    d_body.topRows<6>() = -end_->d_body;
    d_ahrs.topRows<6>() = -end_->d_ahrs;
    d_ahrs.bottomRows<3>() = -scale;
    d_state.topRows<6>() = -end_->d_state;
    d_next_ahrs.bottomRows<3>() = scale;
    d_next.topRows<6>().setIdentity();
    Write<kBodySize>(d_body, jacobians[0]);
    Write<kAhrsSize>(d_ahrs, jacobians[1]);
    Write<kStateSize>(d_state, jacobians[2]);
    Write<kAhrsSize>(d_next_ahrs, jacobians[3]);
    Write<kStateSize>(d_next, jacobians[4]);
  }

  const StateNode* end_;
  Eigen::Vector3d sigma_ahrs_;
  Matrix9d sqrt_information_;
};

}  // namespace trueline
