// The step from one segment of a chain to the next, with process noise for unmodelled
// accelerations, a drifting AHRS error and changing gusts.
//
//   prediction: (p, v) at the segment's end by integration, the drift decayed by alpha; the gust
//               decayed by beta
//   error:      the next node's (p, v, drift, gust) less the prediction
//   weighting:  of (p, v, drift) the inverse Cholesky factor of the covariance that the processes
//               accumulate; of the gust one over the sigma of its step
//   unknowns:   theta; the node's drift and state; the next node's; then both gusts, if any
#pragma once

#include <ceres/cost_function.h>

#include <cstddef>

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
    *mutable_parameter_block_sizes() = {kThetaSize, kGustAt, kGustAt};
    if (HasGusts()) {
      mutable_parameter_block_sizes()->insert(mutable_parameter_block_sizes()->end(),
                                              {kGustSize, kGustSize});
    }
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Path> node(parameters[1]), next(parameters[2]);
    const Weights& w = weights_;
    Path error;
    error << next.tail<6>() - end_->value,
        w.drift_unit.cwiseProduct(next.head<3>() - w.alpha * node.head<3>());
    Eigen::Map<Path> r(residuals);
    r.noalias() = w.sqrt_information.triangularView<Eigen::Lower>() * error;
    for (int i = 0; i < num_residuals() - kGustAt; ++i) {
      residuals[kGustAt + i] = w.gust_weight * (parameters[4][i] - w.beta * parameters[3][i]);
    }
    if (jacobians != nullptr) WriteJacobians(jacobians);
    return r.allFinite();
  }

 private:
  using Path = Eigen::Matrix<double, kGustAt, 1>;

  bool HasGusts() const { return gusts_.gusts != Gusts::kNone; }

  // Writes the derivative by a block: of the path's error, whitened here, and of the gust's step.
  template <int kCols>
  void Write(const Eigen::Matrix<double, kGustAt, kCols>& d_path, double d_gust,
             double* jacobian) const {
    if (jacobian == nullptr) return;
    JacobianBlock<kGustAt, kCols>(jacobian).noalias() =
        weights_.sqrt_information.triangularView<Eigen::Lower>() * d_path;
    if (!HasGusts()) return;
    JacobianBlock<kGustSize, kCols> below(jacobian + static_cast<std::ptrdiff_t>(kGustAt) * kCols);
    below.setZero();
    below.diagonal().setConstant(d_gust);
  }

  void WriteJacobians(double** jacobians) const {
    const Eigen::Matrix3d unit = weights_.drift_unit.asDiagonal();
    Eigen::Matrix<double, kGustAt, kThetaSize> d_theta;
    d_theta << -end_->d_theta, Eigen::Matrix<double, 3, kThetaSize>::Zero();
    Write<kThetaSize>(d_theta, 0.0, jacobians[0]);
    Eigen::Matrix<double, kGustAt, kGustAt> d_node = d_node.Zero(), d_next = d_next.Zero();
    d_node.topRows<6>() << -end_->d_drift(), -end_->d_state;
    d_node.bottomLeftCorner<3, kDriftSize>() = -weights_.alpha * unit;
    Write<kGustAt>(d_node, 0.0, jacobians[1]);
    d_next.topRightCorner<6, kStateSize>().setIdentity();
    d_next.bottomLeftCorner<3, kDriftSize>() = unit;
    Write<kGustAt>(d_next, 0.0, jacobians[2]);
    if (!HasGusts()) return;
    Eigen::Matrix<double, kGustAt, kGustSize> d_gust = d_gust.Zero(), d_next_gust = d_gust.Zero();
    d_gust.topRows<6>() = -gusts_.Own();
    Write<kGustSize>(d_gust, -weights_.beta * weights_.gust_weight, jacobians[3]);
    d_next_gust.topRows<6>() = -gusts_.Next();
    Write<kGustSize>(d_next_gust, weights_.gust_weight, jacobians[4]);
  }

  const StateNode* end_;
  Weights weights_;
  GustSlope<6> gusts_;
};

}  // namespace trueline
