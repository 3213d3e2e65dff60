// The residual of a fix in a pass with an error of its own: a gate displaced from its place on the
// map, or another object detected as the gate.
//
//   prediction: p(t_i) + o + o' (t_i - t_0), with the pass's own offset o (m) and its rate o' (m/s)
//   error:      prediction - fix, in m
//   weighting:  divided by the detector's sigma, the same for each axis
#pragma once

#include "cost_functions/fix_residual.h"

namespace trueline {

inline constexpr int kOffsetSize = 6;  // o, o'

class OffsetFixResidual
    : public ceres::SizedCostFunction<3, kThetaSize, kDriftSize, kStateSize, kOffsetSize> {
 public:
  // `node` must outlive the problem. sigma in m, elapsed = t_i - t_0 in s.
  OffsetFixResidual(const StateNode* node, const Eigen::Vector3d& fix_E, double sigma,
                    double elapsed)
      : fix_(node, fix_E, sigma), weight_(1.0 / sigma), elapsed_(elapsed) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const bool finite = fix_.Evaluate(parameters, residuals, jacobians);
    const Eigen::Map<const Eigen::Vector3d> offset(parameters[3]), rate(parameters[3] + 3);
    Eigen::Map<Eigen::Vector3d>(residuals) += weight_ * (offset + elapsed_ * rate);
    if (jacobians != nullptr && jacobians[3] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, kOffsetSize, Eigen::RowMajor>> J(jacobians[3]);
      J << Eigen::Matrix3d::Identity() * weight_, Eigen::Matrix3d::Identity() * weight_ * elapsed_;
    }
    return finite;
  }

 private:
  FixResidual fix_;
  double weight_;
  double elapsed_;
};

}  // namespace trueline
