// The batch's residuals for Ceres. Blocks: nodes (13 numbers), the constants' chart (kConstants).
#pragma once

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>

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

}  // namespace trueline
