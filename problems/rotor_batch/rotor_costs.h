// The batch's residuals for Ceres. Blocks: nodes (13 numbers), the constants' chart (kConstants).
#pragma once

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>

#include <algorithm>
#include <cmath>

#include "problems/rotor_batch/constants_chart.h"
#include "problems/rotor_batch/rotor_node_manifold.h"
#include "problems/rotor_batch/segment.h"
#include "problems/rotor_data/pose_prediction.h"
#include "problems/rotor_data/rotor_prior.h"

namespace trueline {

template <class Derived>
void WriteJacobian(const Eigen::MatrixBase<Derived>& value, double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      jacobian, value.rows(), value.cols()) = value;
}

// IMU readings of a segment and the step to the next node, whitened together (segment.h).
class SegmentCost : public ceres::CostFunction {
 public:
  explicit SegmentCost(const SegmentModel* segment) : segment_(segment) {
    set_num_residuals(segment->segment().NumRows());
    *mutable_parameter_block_sizes() = {13, 13, RotorAeroModel::kConstants};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const RotorConstants chart = Eigen::Map<const RotorConstants>(parameters[2]);
    SegmentResidual r = segment_->Evaluate(Eigen::Map<const RotorNode>(parameters[0]),
                                           Eigen::Map<const RotorNode>(parameters[1]),
                                           FromChart(chart), jacobians != nullptr);
    segment_->Whiten(&r);
    Eigen::Map<Eigen::VectorXd>(residuals, r.error.size()) = r.error;
    if (jacobians != nullptr) {
      if (jacobians[0]) WriteJacobian(r.d_start * NodeMinusJacobian(parameters[0]), jacobians[0]);
      if (jacobians[1]) WriteJacobian(r.d_next * NodeMinusJacobian(parameters[1]), jacobians[1]);
      if (jacobians[2]) WriteJacobian(r.d_constants * ChartJacobian(chart), jacobians[2]);
    }
    return r.error.allFinite();
  }

 private:
  const SegmentModel* segment_;
};

struct PoseResidual {
  Eigen::VectorXd error;        // in sigmas
  Eigen::MatrixXd d_node;       // rows x 12
  Eigen::MatrixXd d_constants;  // rows x kConstants, SI
};
PoseResidual EvaluatePose(const RotorPose& pose, bool attitude, const RotorNoise& noise,
                          const RotorNode& node, const RotorConstants& constants);

// Residual of a pose (or position) and its node.
class PoseCost : public ceres::CostFunction {
 public:
  PoseCost(const RotorPose& pose, bool attitude, const RotorNoise& noise)
      : pose_(pose), attitude_(attitude), noise_(noise) {
    set_num_residuals(attitude ? 6 : 3);
    *mutable_parameter_block_sizes() = {13, RotorAeroModel::kConstants};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const RotorConstants chart = Eigen::Map<const RotorConstants>(parameters[1]);
    const PoseResidual r = EvaluatePose(
        pose_, attitude_, noise_, Eigen::Map<const RotorNode>(parameters[0]), FromChart(chart));
    Eigen::Map<Eigen::VectorXd>(residuals, r.error.size()) = r.error;
    if (jacobians != nullptr) {
      if (jacobians[0]) WriteJacobian(r.d_node * NodeMinusJacobian(parameters[0]), jacobians[0]);
      if (jacobians[1]) WriteJacobian(r.d_constants * ChartJacobian(chart), jacobians[1]);
    }
    return r.error.allFinite();
  }

 private:
  const RotorPose& pose_;
  bool attitude_;
  const RotorNoise& noise_;
};

// (constant - prior mean) / prior sigma, for all free constants.
class ConstantsPriorCost : public ceres::CostFunction {
 public:
  explicit ConstantsPriorCost(const RotorPrior& prior) : prior_(prior), free_(prior.Free()) {
    set_num_residuals(static_cast<int>(free_.size()));
    *mutable_parameter_block_sizes() = {RotorAeroModel::kConstants};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const RotorConstants chart = Eigen::Map<const RotorConstants>(parameters[0]);
    const RotorConstants constants = FromChart(chart);
    const ConstantsJacobian jacobian = ChartJacobian(chart);
    Eigen::MatrixXd rows(free_.size(), RotorAeroModel::kConstants);
    for (std::size_t i = 0; i < free_.size(); ++i) {
      const int c = free_[i];
      residuals[i] = (constants[c] - prior_.mean[c]) / prior_.sigma[c];
      rows.row(static_cast<Eigen::Index>(i)) = jacobian.row(c) / prior_.sigma[c];
    }
    if (jacobians != nullptr && jacobians[0] != nullptr) WriteJacobian(rows, jacobians[0]);
    return Eigen::Map<const Eigen::VectorXd>(residuals, num_residuals()).allFinite();
  }

 private:
  const RotorPrior& prior_;
  std::vector<int> free_;
};

// The curvature of the cost that Gauss-Newton lacks where data and prior disagree about an inertia.
// Readings are proportional to 1/I. At the solution the gradient of the data's cost is opposite to
// the prior's, (I - mean) / sigma^2, and its curvature is 2 (I - mean) / (I sigma^2) larger than
// Gauss-Newton's. Many sigmas from the mean this exceeds the prior's own 1 / sigma^2: without it
// steps are more than twice too long and the iteration oscillates. These rows have zero error and
// non-zero slopes, so they change the steps and leave the solution unchanged.
class InertiaBendCost : public ceres::CostFunction {
 public:
  static constexpr int kRows = 3;

  explicit InertiaBendCost(const RotorPrior& prior) : prior_(prior) {
    set_num_residuals(kRows);
    *mutable_parameter_block_sizes() = {RotorAeroModel::kConstants};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d>{residuals}.setZero();
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    const RotorConstants chart = Eigen::Map<const RotorConstants>(parameters[0]);
    const RotorConstants constants = FromChart(chart);
    Eigen::MatrixXd rows = ChartJacobian(chart).middleRows<kRows>(kInertiaConstants);
    for (int i = 0; i < kRows; ++i) {
      const int c = kInertiaConstants + i;
      // The curvature is negative below the mean; a sum of squares cannot represent it, so it is 0.
      const double bend = std::max(0.0, 2.0 * (1.0 - prior_.mean[c] / constants[c]));
      rows.row(i) *= std::sqrt(bend) / prior_.sigma[c];
    }
    WriteJacobian(rows, jacobians[0]);
    return true;
  }

 private:
  const RotorPrior& prior_;
};

}  // namespace trueline
