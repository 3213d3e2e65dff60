// The step from the end of one segment of a window to the start of the next, with process noise for
// unmodelled accelerations and a drifting AHRS error.
//
//   prediction: (p, v) at the segment's end by integration, the drift decayed by alpha
//   error:      the next segment's (p, v, drift) less the prediction
//   weighting:  inverse Cholesky factor of the covariance that the processes accumulate
#pragma once

#include <ceres/sized_cost_function.h>

#include "cost_functions/models/process_noise.h"
#include "cost_functions/segment_node.h"

namespace trueline {

class ContinuityResidual : public ceres::SizedCostFunction<9, kThetaSize, kDriftSize, kStateSize,
                                                           kDriftSize, kStateSize> {
 public:
  // sigma_drift: rad for each unit of the drift blocks. alpha: factor on the drift over the
  // segment. sqrt_information: L^-1 of the covariance L L' of (p, v, drift in rad).
  ContinuityResidual(const StateNode* end, const Eigen::Vector3d& sigma_drift, double alpha,
                     const Matrix9d& sqrt_information)
      : end_(end), sigma_drift_(sigma_drift), alpha_(alpha), sqrt_information_(sqrt_information) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> drift(parameters[1]), next_drift(parameters[3]);
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> next(parameters[4]);
    Eigen::Matrix<double, 9, 1> error;
    error << next - end_->value, sigma_drift_.cwiseProduct(next_drift - alpha_ * drift);
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
    const Eigen::Matrix3d scale = sigma_drift_.asDiagonal();
    Eigen::Matrix<double, 9, kThetaSize> d_theta = Eigen::Matrix<double, 9, kThetaSize>::Zero();
    Eigen::Matrix<double, 9, kDriftSize> d_drift = Eigen::Matrix<double, 9, kDriftSize>::Zero();
    Eigen::Matrix<double, 9, kStateSize> d_state = Eigen::Matrix<double, 9, kStateSize>::Zero();
    Eigen::Matrix<double, 9, kDriftSize> d_next_drift =
        Eigen::Matrix<double, 9, kDriftSize>::Zero();
    Eigen::Matrix<double, 9, kStateSize> d_next = Eigen::Matrix<double, 9, kStateSize>::Zero();
    d_theta.topRows<6>() = -end_->d_theta;
    d_drift.topRows<6>() = -end_->d_drift();
    d_drift.bottomRows<3>() = -alpha_ * scale;
    d_state.topRows<6>() = -end_->d_state;
    d_next_drift.bottomRows<3>() = scale;
    d_next.topRows<6>().setIdentity();
    Write<kThetaSize>(d_theta, jacobians[0]);
    Write<kDriftSize>(d_drift, jacobians[1]);
    Write<kStateSize>(d_state, jacobians[2]);
    Write<kDriftSize>(d_next_drift, jacobians[3]);
    Write<kStateSize>(d_next, jacobians[4]);
  }

  const StateNode* end_;
  Eigen::Vector3d sigma_drift_;
  double alpha_;
  Matrix9d sqrt_information_;
};

}  // namespace trueline
