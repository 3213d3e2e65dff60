// What was marginalised out of a window, as a prior on its first unknowns:
// sqrt_information * ((theta, drift, state) - mean), in the units of the parameter blocks.
#pragma once

#include <ceres/sized_cost_function.h>

#include "cost_functions/segment_node.h"

namespace trueline {

class WindowPriorResidual
    : public ceres::SizedCostFunction<kThetaSize + kDriftSize + kStateSize, kThetaSize, kDriftSize,
                                      kStateSize> {
 public:
  static constexpr int kSize = kThetaSize + kDriftSize + kStateSize;
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Matrix = Eigen::Matrix<double, kSize, kSize>;

  WindowPriorResidual(const Vector& mean, const Matrix& sqrt_information)
      : mean_(mean), sqrt_information_(sqrt_information) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Vector x;
    x << Eigen::Map<const Eigen::Matrix<double, kThetaSize, 1>>(parameters[0]),
        Eigen::Map<const Eigen::Matrix<double, kDriftSize, 1>>(parameters[1]),
        Eigen::Map<const Eigen::Matrix<double, kStateSize, 1>>(parameters[2]);
    Eigen::Map<Vector> r(residuals);
    r = sqrt_information_ * (x - mean_);
    if (jacobians != nullptr) {
      Write<0, kThetaSize>(jacobians[0]);
      Write<kThetaSize, kDriftSize>(jacobians[1]);
      Write<kThetaSize + kDriftSize, kStateSize>(jacobians[2]);
    }
    return true;
  }

 private:
  template <int kFirst, int kCols>
  void Write(double* jacobian) const {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, kSize, kCols, Eigen::RowMajor>> J(jacobian);
    J = sqrt_information_.template middleCols<kCols>(kFirst);
  }

  Vector mean_;
  Matrix sqrt_information_;
};

}  // namespace trueline
