// The step of theta from one section of a flight to the next: biases and the AHRS error do a random
// walk, the airframe's parameters are constant.
//
//   error:      next - theta, in units of theta's prior sigma
//   weighting:  one over the sigma of each step; zero removes the coupling
#pragma once

#include <ceres/sized_cost_function.h>

#include "cost_functions/segment_node.h"

namespace trueline {

class ParameterStepResidual : public ceres::SizedCostFunction<kThetaSize, kThetaSize, kThetaSize> {
 public:
  using Vector = Eigen::Matrix<double, kThetaSize, 1>;

  explicit ParameterStepResidual(const Vector& weight) : weight_(weight) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Vector> theta(parameters[0]), next(parameters[1]);
    Eigen::Map<Vector> r(residuals);
    r = weight_.cwiseProduct(next - theta);
    using Jacobian = Eigen::Matrix<double, kThetaSize, kThetaSize, Eigen::RowMajor>;
    for (int i = 0; jacobians != nullptr && i < 2; ++i) {
      if (jacobians[i] == nullptr) continue;
      const Vector diagonal = i == 0 ? Vector(-weight_) : weight_;
      Eigen::Map<Jacobian> J(jacobians[i]);
      J = diagonal.asDiagonal();
    }
    return true;
  }

 private:
  Vector weight_;
};

}  // namespace trueline
