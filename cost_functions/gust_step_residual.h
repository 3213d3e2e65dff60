// The step of a gust from the start of a segment to that of the next.
//
//   prediction: beta * gust, its decay
//   error:      next gust - prediction, in m/s^2
//   weighting:  by the sigma under which the process keeps its stationary sigma
#pragma once

#include <ceres/sized_cost_function.h>

#include "cost_functions/models/gust.h"

namespace trueline {

class GustStepResidual : public ceres::SizedCostFunction<kGustSize, kGustSize, kGustSize> {
 public:
  // beta in [0, 1); weight is one over sigma, s^2/m.
  GustStepResidual(double beta, double weight) : beta_(beta), weight_(weight) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (int i = 0; i < kGustSize; ++i) {
      residuals[i] = weight_ * (parameters[1][i] - beta_ * parameters[0][i]);
    }
    if (jacobians == nullptr) return true;
    using Square = Eigen::Matrix<double, kGustSize, kGustSize, Eigen::RowMajor>;
    const Square scaled = Square::Identity() * weight_;
    if (jacobians[0] != nullptr) Eigen::Map<Square>{jacobians[0]} = -beta_ * scaled;
    if (jacobians[1] != nullptr) Eigen::Map<Square>{jacobians[1]} = scaled;
    return true;
  }

 private:
  double beta_, weight_;
};

}  // namespace trueline
