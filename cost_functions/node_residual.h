// A measurement of the first components of a segment's node: weight * (node - measured).
#pragma once

#include <ceres/sized_cost_function.h>

#include "cost_functions/segment_node.h"

namespace trueline {

template <int kNodeSize, int kSize>
class NodeResidual
    : public ceres::SizedCostFunction<kSize, kThetaSize, kDriftSize, kStateSize> {
 public:
  using Vector = Eigen::Matrix<double, kSize, 1>;

  // `node` must outlive the problem; `weight` is one over sigma for each component.
  NodeResidual(const SegmentNode<kNodeSize>* node, const Vector& measured, const Vector& weight)
      : node_(node), measured_(measured), weight_(weight) {}

  bool Evaluate(double const* const* /*parameters*/, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Vector> r(residuals);
    r = weight_.cwiseProduct(node_->value.template head<kSize>() - measured_);
    if (jacobians != nullptr) {
      Write<kThetaSize>(node_->d_theta, jacobians[0]);
      Write<kDriftSize>(node_->d_drift(), jacobians[1]);
      Write<kStateSize>(node_->d_state, jacobians[2]);
    }
    return r.allFinite();
  }

 private:
  template <int kCols, class Derivative>
  void Write(const Derivative& derivative, double* jacobian) const {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, kSize, kCols, Eigen::RowMajor>> J(jacobian);
    J = weight_.asDiagonal() * derivative.template topRows<kSize>();
  }

  const SegmentNode<kNodeSize>* node_;
  Vector measured_;
  Vector weight_;
};

}  // namespace trueline
