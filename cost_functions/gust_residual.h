// A residual of a segment that also depends on gusts.
//
//   prediction: the inner residual's; its node already includes the gusts' effect
//   unknowns:   the inner residual's, then the gust at the segment's start, and that at its end
//               unless the gust is constant over the segment
#pragma once

#include <ceres/cost_function.h>

#include <memory>

#include "cost_functions/models/gust.h"

namespace trueline {

class GustResidual : public ceres::CostFunction {
 public:
  // d_gusts: derivative of the (weighted) residual by both gusts. `held`: the end's gust is the
  // start's.
  GustResidual(std::unique_ptr<ceres::CostFunction> inner, const Eigen::MatrixXd& d_gusts,
               bool held)
      : inner_(std::move(inner)), d_first_(d_gusts.leftCols<kGustSize>()) {
    set_num_residuals(inner_->num_residuals());
    *mutable_parameter_block_sizes() = inner_->parameter_block_sizes();
    mutable_parameter_block_sizes()->push_back(kGustSize);
    if (held) {
      d_first_ += d_gusts.rightCols<kGustSize>();
    } else {
      d_second_ = d_gusts.rightCols<kGustSize>();
      mutable_parameter_block_sizes()->push_back(kGustSize);
    }
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const bool finite = inner_->Evaluate(parameters, residuals, jacobians);
    if (jacobians != nullptr) {
      const std::size_t first = inner_->parameter_block_sizes().size();
      Write(d_first_, jacobians[first]);
      if (d_second_.size() > 0) Write(d_second_, jacobians[first + 1]);
    }
    return finite;
  }

 private:
  using Derivative = Eigen::Matrix<double, Eigen::Dynamic, kGustSize, Eigen::RowMajor>;

  static void Write(const Derivative& d, double* jacobian) {
    if (jacobian != nullptr) Eigen::Map<Derivative>(jacobian, d.rows(), kGustSize) = d;
  }

  std::unique_ptr<ceres::CostFunction> inner_;
  Derivative d_first_, d_second_;
};

}  // namespace trueline
