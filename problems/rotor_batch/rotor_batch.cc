#include "problems/rotor_batch/rotor_batch.h"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <array>
#include <cmath>
#include <memory>

#include "problems/common/error.h"
#include "problems/rotor_batch/constants_information.h"
#include "problems/rotor_batch/rotor_costs.h"
#include "problems/rotor_batch/rotor_normal.h"
#include "problems/rotor_data/rough_nodes.h"

namespace trueline {

PoseResidual EvaluatePose(const RotorPose& pose, bool attitude, const RotorNoise& noise,
                          const RotorNode& node, const RotorConstants& constants) {
  std::array<RotorJet, RotorAeroModel::kStates> x;
  std::array<RotorJet, 6> error;
  SeedErrors(Joined(node, constants), x.data());
  PoseError(pose, attitude, noise, x.data(), error.data());
  const int rows = attitude ? 6 : 3;
  PoseResidual r{Eigen::VectorXd(rows), Eigen::MatrixXd(rows, 12),
                 Eigen::MatrixXd(rows, RotorAeroModel::kConstants)};
  for (int i = 0; i < rows; ++i) {
    r.error[i] = error[i].a;
    r.d_node.row(i) = error[i].v.head<12>().transpose();
    r.d_constants.row(i) = error[i].v.tail<RotorAeroModel::kConstants>().transpose();
  }
  return r;
}

namespace {

void CheckPrior(const RotorPrior& prior, const RotorData& data) {
  if (!data.motors && MotorsOf(prior.sigma).maxCoeff() > 0.0) {
    throw InputError(
        "motor_lag, motor_idle and motor_voltage can be fitted to motor commands only; set their "
        "prior to 0, or say how commands turn the motors by `motors`");
  }
  const int free =
      static_cast<int>((prior.sigma.segment<3>(kInertiaConstants).array() > 0.0).count());
  if (free != 0 && free != 3) {
    throw InputError("I_x, I_y and I_z are either all known (sigma 0) or all unknown");
  }
  if (!IsPhysicalInertia(prior.mean.segment<3>(kInertiaConstants)) || !(prior.mean[0] > 0.0)) {
    throw InputError(
        "the prior's mass or inertia is not that of a body: moments must be positive and each "
        "below the sum of the other two");
  }
}

class Batch {
 public:
  Batch(const RotorAeroModel& model, const RotorData& data, const RotorBatchOptions& options)
      : data_(data), options_(options) {
    CheckPrior(options.prior, data);
    for (RotorSegment& segment : CutSegments(data)) {
      segments_.emplace_back(model, data, options.noise, std::move(segment));
    }
    chart_ = ToChart(options.prior.mean);
    nodes_ = RoughNodes(data, options.prior.mean);
  }

  RotorBatchResult Run(const RotorBatchResult* start) {
    if (start != nullptr) StartFrom(*start);
    RotorBatchResult result;
    Build();
    // A solution nearby has the right weights already.
    for (int k = start != nullptr ? options_.reweights : 0; k <= options_.reweights; ++k) {
      SetWeights();
      Solve(&result);
    }
    result.mean = FromChart(chart_);
    result.nodes = nodes_;
    result.cov = Covariance(&result.log_evidence);
    result.log_evidence -= result.cost;
    return result;
  }

  // Takes weights and information at given states.
  Eigen::MatrixXd BoundAt(const std::vector<RotorNode>& nodes, const RotorConstants& constants) {
    nodes_ = nodes;
    chart_ = ToChart(constants);
    SetWeights();
    double ignored = 0.0;
    return Covariance(&ignored);
  }

 private:
  void StartFrom(const RotorBatchResult& start) {
    RotorConstants constants = start.mean;
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      if (options_.prior.sigma[i] == 0.0) constants[i] = options_.prior.mean[i];
    }
    chart_ = ToChart(constants);
    nodes_ = start.nodes;
  }

  void Build() {
    ceres::Problem::Options ownership;
    ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_ = std::make_unique<ceres::Problem>(ownership);
    for (RotorNode& node : nodes_) problem_->AddParameterBlock(node.data(), 13, &manifold_);
    problem_->AddParameterBlock(chart_.data(), RotorAeroModel::kConstants);
    std::vector<int> known;
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      if (options_.prior.sigma[i] == 0.0) known.push_back(i);
    }
    if (known.size() == RotorAeroModel::kConstants) {
      problem_->SetParameterBlockConstant(chart_.data());
    } else {
      known_ = std::make_unique<ceres::SubsetManifold>(RotorAeroModel::kConstants, known);
      problem_->SetManifold(chart_.data(), known_.get());
      problem_->AddResidualBlock(new ConstantsPriorCost(options_.prior), nullptr, chart_.data());
    }
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      problem_->AddResidualBlock(new SegmentCost(&segments_[i]), nullptr, nodes_[i].data(),
                                 nodes_[i + 1].data(), chart_.data());
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      ceres::LossFunction* loss =
          options_.robust_pose > 0.0 ? new ceres::HuberLoss(options_.robust_pose) : nullptr;
      problem_->AddResidualBlock(new PoseCost(data_.poses[i], data_.attitude, options_.noise), loss,
                                 nodes_[i].data(), chart_.data());
    }
  }

  void SetWeights() {
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      segments_[i].SetWeight(nodes_[i], FromChart(chart_));
    }
  }

  void Solve(RotorBatchResult* result) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
    options.max_num_iterations = options_.max_iterations;
    options.function_tolerance = 1e-8;
    options.initial_trust_region_radius = 1e6;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, problem_.get(), &summary);
    result->converged = summary.termination_type == ceres::CONVERGENCE;
    result->iterations += static_cast<int>(summary.iterations.size());
    result->cost = summary.final_cost;
    result->residuals = summary.num_residuals;
    result->solve_time += summary.total_time_in_seconds;
  }

  // Also the part of the log evidence that the determinants give.
  Eigen::MatrixXd Covariance(double* log_evidence) const {
    const RotorConstants constants = FromChart(chart_);
    const std::vector<int> free = options_.prior.Free();
    ConstantsInformation information(free, options_.prior.sigma);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const PoseResidual pose =
          EvaluatePose(data_.poses[i], data_.attitude, options_.noise, nodes_[i], constants);
      const double root = std::sqrt(options_.PoseWeight(pose.error.norm()));
      information.AddAtNode(root * pose.d_node, root * pose.d_constants);
      *log_evidence -=
          static_cast<double>(data_.attitude ? 3 : 0) * std::log(options_.noise.attitude) +
          3.0 * std::log(options_.noise.position);
      if (i == segments_.size()) break;
      SegmentResidual step = segments_[i].Evaluate(nodes_[i], nodes_[i + 1], constants, true);
      segments_[i].Whiten(&step);
      information.StepToNext(step.d_start, step.d_next, step.d_constants);
      *log_evidence -= 0.5 * segments_[i].LogDeterminant();
    }
    const auto size = static_cast<Eigen::Index>(free.size());
    const Eigen::MatrixXd posterior = information.Finish() + Eigen::MatrixXd::Identity(size, size);
    const Eigen::LLT<Eigen::MatrixXd> llt(posterior);
    *log_evidence -=
        0.5 * information.log_determinant() + llt.matrixLLT().diagonal().array().log().sum();
    const Eigen::MatrixXd scaled = llt.solve(Eigen::MatrixXd::Identity(size, size));
    Eigen::MatrixXd cov =
        Eigen::MatrixXd::Zero(RotorAeroModel::kConstants, RotorAeroModel::kConstants);
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j < size; ++j) {
        cov(free[i], free[j]) =
            scaled(i, j) * options_.prior.sigma[free[i]] * options_.prior.sigma[free[j]];
      }
    }
    return cov;
  }

  const RotorData& data_;
  const RotorBatchOptions& options_;
  std::vector<SegmentModel> segments_;
  std::vector<RotorNode> nodes_;
  RotorConstants chart_;
  RotorNodeManifold manifold_;
  std::unique_ptr<ceres::SubsetManifold> known_;
  std::unique_ptr<ceres::Problem> problem_;
};

// Values that motors can have, in the direction of an estimate.
MotorValues Possible(const MotorValues& estimate) {
  constexpr double kShortestLag = 1e-3;  // s
  MotorValues at = estimate;
  at[kLag] = std::max(at[kLag], kShortestLag);
  at[kIdle] = std::min(at[kIdle], 0.95);
  return at;
}

// Speeds are linear in the motors' unknowns about the values at which `data` holds them: taken anew
// at each solution until that stays where it is.
RotorBatchResult SolveTurningMotors(const RotorAeroModel& model, RotorData* data,
                                    const RotorBatchOptions& options,
                                    const RotorBatchResult* start) {
  constexpr int kMostTurns = 8;
  constexpr double kSettled = 0.05;  // sigmas
  RotorBatchResult result = Batch(model, *data, options).Run(start);
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const MotorValues at = Possible(MotorsOf(result.mean));
    const MotorValues moved = (at - data->motors_at).cwiseAbs();
    if ((moved.array() <= kSettled * MotorsOf(result.Sigma()).array()).all()) break;
    data->TurnMotors(at);
    const RotorBatchResult before = result;
    result = Batch(model, *data, options).Run(&before);
    result.iterations += before.iterations;
    result.solve_time += before.solve_time;
  }
  return result;
}

}  // namespace

RotorBatchResult RunRotorBatch(const RotorAeroModel& model, const RotorData& flown,
                               const RotorBatchOptions& options, const RotorBatchResult* start) {
  RotorData turned;
  const bool turns = MotorsOf(options.prior.sigma).maxCoeff() > 0.0;
  if (turns && flown.motors) turned = flown;
  const RotorData& data = turned.motors ? turned : flown;
  RotorBatchResult result = turned.motors ? SolveTurningMotors(model, &turned, options, start)
                                          : Batch(model, data, options).Run(start);
  if (!options.widen) return result;
  result.widened = WideningFactors(model, data, options, result);
  result.cov = result.widened.asDiagonal() * result.cov * result.widened.asDiagonal();
  return result;
}

Eigen::MatrixXd RotorBound(const RotorAeroModel& model, const RotorData& data,
                           const RotorBatchOptions& options, const std::vector<RotorNode>& nodes,
                           const RotorConstants& constants) {
  return Batch(model, data, options).BoundAt(nodes, constants);
}

}  // namespace trueline
