#include "problems/rotor_batch/rotor_batch.h"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <glog/logging.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "problems/common/error.h"
#include "problems/rotor_batch/fixed_point.h"
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

// Shares of the inertia's trace. A second moment of mass below kFlat counts as zero; a zero moment
// that is freed starts at kThick.
constexpr double kFlat = 1e-5;
constexpr double kThick = 1e-2;

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

  RotorBatchResult Run() {
    RotorBatchResult result;
    Build();
    for (int k = 0; k <= options_.reweights; ++k) {
      SetWeights(FromChart(chart_));
      Solve(&result);
    }
    return Finished(std::move(result));
  }

  // Solves from `start`, a solution nearby, with weights evaluated at the given states and
  // constants.
  RotorBatchResult RunFrom(const RotorBatchResult& start, const std::vector<RotorNode>& nodes,
                           const RotorConstants& constants) {
    nodes_ = nodes;
    SetWeights(FromChart(ToChart(WithKnown(constants))));
    chart_ = ToChart(WithKnown(start.mean));
    nodes_ = start.nodes;
    RotorBatchResult result;
    Build();
    HoldFlat();
    Solve(&result);
    if (FreeFlat()) Solve(&result);
    return Finished(std::move(result));
  }

  // Evaluates weights and information at the given states.
  Eigen::MatrixXd BoundAt(const std::vector<RotorNode>& nodes, const RotorConstants& constants) {
    nodes_ = nodes;
    chart_ = ToChart(constants);
    SetWeights(FromChart(chart_));
    return Covariance(nullptr);
  }

 private:
  RotorBatchResult Finished(RotorBatchResult result) const {
    result.mean = FromChart(chart_);
    result.nodes = nodes_;
    result.cov = Covariance(&result.log_evidence);
    result.log_evidence -= result.cost;
    return result;
  }

  RotorConstants WithKnown(RotorConstants constants) const {
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      if (options_.prior.sigma[i] == 0.0) constants[i] = options_.prior.mean[i];
    }
    return constants;
  }

  void Build() {
    ceres::Problem::Options ownership;
    ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_ = std::make_unique<ceres::Problem>(ownership);
    for (RotorNode& node : nodes_) problem_->AddParameterBlock(node.data(), 13, &manifold_);
    problem_->AddParameterBlock(chart_.data(), RotorAeroModel::kConstants);
    if (options_.prior.Free().empty()) {
      problem_->SetParameterBlockConstant(chart_.data());
    } else {
      Hold({});
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

  bool InertiaIsFree() const { return options_.prior.sigma[kInertiaConstants] > 0.0; }

  // Holds these coordinates of the chart constant, and those of all known constants.
  void Hold(std::vector<int> held) {
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      if (options_.prior.sigma[i] == 0.0) held.push_back(i);
    }
    held_ = std::make_unique<ceres::SubsetManifold>(RotorAeroModel::kConstants, held);
    problem_->SetManifold(chart_.data(), held_.get());
  }

  // Holds second moments that start at zero (a flat body). log(0) makes the Gauss-Newton step in
  // such a moment infinite, and that step would move the other constants to where the moment is
  // negative.
  void HoldFlat() {
    if (!InertiaIsFree()) return;
    const double trace = FromChart(chart_).segment<3>(kInertiaConstants).sum();
    for (int i = kInertiaConstants; i < kInertiaConstants + 3; ++i) {
      if (std::exp(chart_[i]) < kFlat * trace) flat_.push_back(i);
    }
    if (!flat_.empty()) Hold(flat_);
  }

  // Frees each held moment whose gradient points to growth and starts it at kThick. True if any.
  bool FreeFlat() {
    if (flat_.empty()) return false;
    ceres::Problem::EvaluateOptions by_chart;
    by_chart.parameter_blocks = {chart_.data()};
    std::vector<double> gradient;
    problem_->SetManifold(chart_.data(), nullptr);
    problem_->Evaluate(by_chart, nullptr, nullptr, &gradient, nullptr);
    const double trace = FromChart(chart_).segment<3>(kInertiaConstants).sum();
    std::vector<int> still;
    for (const int i : flat_) {
      if (gradient[i] < 0.0) {
        chart_[i] = std::log(kThick * trace);
      } else {
        still.push_back(i);
      }
    }
    Hold(still);
    return still.size() < flat_.size();
  }

  void SetWeights(const RotorConstants& at) {
    for (std::size_t i = 0; i < segments_.size(); ++i) segments_[i].SetWeight(nodes_[i], at);
  }

  void Solve(RotorBatchResult* result) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
    options.max_num_iterations = options_.max_iterations;
    options.function_tolerance = 1e-8;
    options.initial_trust_region_radius = 1e10;
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

  // Covariance of the constants, and the determinants' part of the log evidence where asked for.
  Eigen::MatrixXd Covariance(double* log_evidence) const {
    const RotorConstants constants = FromChart(chart_);
    const BorderedChain<kNodeErrors> chain =
        LinearChain(data_, options_, segments_, nodes_, constants, {}, INFINITY);
    CHECK(chain.regular()) << "a pose does not determine its node";
    const ReducedSystem reduced = chain.Reduced(BorderPrior(options_.prior, constants, 0));
    if (log_evidence != nullptr) *log_evidence = reduced.LogDeterminants(reduced.border());
    return InUnits(options_.prior, reduced.Covariance());
  }

  const RotorData& data_;
  const RotorBatchOptions& options_;
  std::vector<SegmentModel> segments_;
  std::vector<RotorNode> nodes_;
  RotorConstants chart_;
  RotorNodeManifold manifold_;
  std::vector<int> flat_;  // held second moments of the chart
  std::unique_ptr<ceres::SubsetManifold> held_;
  std::unique_ptr<ceres::Problem> problem_;
};

// The estimate clamped to values that motors can have.
MotorValues Possible(const MotorValues& estimate) {
  constexpr double kShortestLag = 1e-3;  // s
  MotorValues at = estimate;
  at[kLag] = std::max(at[kLag], kShortestLag);
  at[kIdle] = std::min(at[kIdle], 0.95);
  return at;
}

// Rotor speeds from commands are linearised in the motors' unknowns at the values that `data`
// holds. This function relinearises until the linearisation point is the solution. It re-evaluates
// the weights at each point too, unless `start` is given: that solution's weights are kept. Until
// the point has converged a few iterations of each solve are enough.
RotorBatchResult SolveTurningMotors(const RotorAeroModel& model, RotorData* data,
                                    const RotorBatchOptions& options,
                                    const RotorBatchResult* start) {
  constexpr int kMostTurns = 20;
  constexpr int kFew = 4;           // iterations
  constexpr double kSettled = 0.1;  // sigmas
  RotorBatchOptions rough = options;
  rough.max_iterations = std::min(kFew, options.max_iterations);
  RotorBatchResult result = start != nullptr ? *start : Batch(model, *data, options).Run();
  if (start != nullptr) result.iterations = 0, result.solve_time = 0.0;
  RotorConstants at = result.mean;
  FixedPoint fixed_point;
  bool settled = false;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    data->TurnMotors(Possible(MotorsOf(at)));
    const RotorBatchResult before = std::move(result);
    Batch batch(model, *data, settled || turn + 1 == kMostTurns ? options : rough);
    result = start != nullptr ? batch.RunFrom(before, start->nodes, start->mean)
                              : batch.RunFrom(before, before.nodes, at);
    result.iterations += before.iterations;
    result.solve_time += before.solve_time;
    RotorConstants sigma = result.Sigma();
    if (start != nullptr) sigma.head<RotorAeroModel::kMotors - RotorAeroModel::kMoving>().setZero();
    const RotorConstants moved = (result.mean - at).cwiseAbs();
    settled = (sigma.array() == 0.0 || moved.array() <= kSettled * sigma.array()).all();
    if (settled && result.converged) break;
    if (settled) continue;
    const RotorConstants next = fixed_point.Next(at, result.mean, sigma);
    const bool exists = next[0] > 0.0 && next.segment<3>(kInertiaConstants).sum() > 0.0;
    at = exists ? next : result.mean;  // the mixed value may have no mass or inertia
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
  RotorBatchResult result =
      turned.motors      ? SolveTurningMotors(model, &turned, options, start)
      : start != nullptr ? Batch(model, data, options).RunFrom(*start, start->nodes, start->mean)
                         : Batch(model, data, options).Run();
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
