// The step from one segment of a chain to the next, with process noise for unmodelled
// accelerations, a drifting AHRS error and changing gusts.
//
//   prediction: (p, v) at the segment's end by integration, the drift decayed by alpha; the gust
//               decayed by beta
//   error:      the next node's (p, v, drift, gust) less the prediction
//   weighting:  of (p, v, drift) the inverse Cholesky factor of the covariance that the processes
//               accumulate; of the gust one over the sigma of its step
//   unknowns:   theta, node, next node
#pragma once

#include <ceres/cost_function.h>

#include "cost_functions/models/process_noise.h"
#include "cost_functions/node_residual.h"

namespace trueline {

class ContinuityResidual : public ceres::CostFunction {
 public:
  struct Weights {
    Eigen::Vector3d drift_unit;  // rad for each unit of the nodes' drift
    double alpha;                // factor on the drift over the segment
    Matrix9d sqrt_information;   // L^-1 of the covariance L L' of (p, v, drift in rad)
    double beta = 0.0;           // factor on the gust over the segment
    double gust_weight = 0.0;    // one over the sigma of the gust's step, m/s^2
  };

  // `end` must outlive the problem. `gusts`: of `end`; none, or linked.
  ContinuityResidual(const StateNode* end, const Weights& weights, const GustSlope<6>& gusts = {})
      : end_(end), weights_(weights), gusts_(gusts) {
    set_num_residuals(HasGusts() ? kNodeSize : kGustAt);
    const int node = NodeBlockSize(gusts.gusts);
    *mutable_parameter_block_sizes() = {kThetaSize, node, node};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Matrix<double, 9, 1>> node(parameters[1]), next(parameters[2]);
    const Weights& w = weights_;
    Eigen::Matrix<double, 9, 1> error;
    error << next.tail<6>() - end_->value,
        w.drift_unit.cwiseProduct(next.head<3>() - w.alpha * node.head<3>());
    Eigen::Map<Eigen::Matrix<double, 9, 1>> r(residuals);
    r.noalias() = w.sqrt_information.triangularView<Eigen::Lower>() * error;
    for (int i = kGustAt; i < num_residuals(); ++i) {
      residuals[i] = w.gust_weight * (parameters[2][i] - w.beta * parameters[1][i]);
    }
    if (jacobians != nullptr) WriteJacobians(jacobians);
    return r.allFinite();
  }

 private:
  using Block = JacobianBlock<Eigen::Dynamic>;

  bool HasGusts() const { return gusts_.gusts != Gusts::kNone; }

  void WriteJacobians(double** jacobians) const {
    const int rows = num_residuals(), node = parameter_block_sizes()[1];
    const auto L = weights_.sqrt_information.triangularView<Eigen::Lower>();
    const Eigen::Matrix3d unit = weights_.drift_unit.asDiagonal();
    if (jacobians[0] != nullptr) {
      Block J(jacobians[0], rows, kThetaSize);
      J.setZero();
      J.topRows<6>() = -end_->d_theta;
      J.topRows<9>() = (L * J.topRows<9>()).eval();
    }
    if (jacobians[1] != nullptr) {
      Block J(jacobians[1], rows, node);
      J.setZero();
      J.topLeftCorner<6, kDriftSize>() = -end_->d_drift();
      J.block<3, kDriftSize>(6, 0) = -weights_.alpha * unit;
      J.block<6, kStateSize>(0, kStateAt) = -end_->d_state;
      if (HasGusts()) J.block<6, kGustSize>(0, kGustAt) = -gusts_.Own();
      J.topRows<9>() = (L * J.topRows<9>()).eval();
      WriteGustStep(-weights_.beta, &J);
    }
    if (jacobians[2] != nullptr) {
      Block J(jacobians[2], rows, node);
      J.setZero();
      J.block<3, kDriftSize>(6, 0) = unit;
      J.block<6, kStateSize>(0, kStateAt).setIdentity();
      if (HasGusts()) J.block<6, kGustSize>(0, kGustAt) = -gusts_.Next();
      J.topRows<9>() = (L * J.topRows<9>()).eval();
      WriteGustStep(1.0, &J);
    }
  }

  void WriteGustStep(double factor, Block* J) const {
    if (!HasGusts()) return;
    J->block<kGustSize, kGustSize>(kGustAt, kGustAt)
        .diagonal()
        .setConstant(factor * weights_.gust_weight);
  }

  const StateNode* end_;
  Weights weights_;
  GustSlope<6> gusts_;
};

}  // namespace trueline
