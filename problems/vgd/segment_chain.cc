#include "problems/vgd/segment_chain.h"

#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>

#include "cost_functions/drag_residual.h"
#include "problems/common/ceres_problem.h"
#include "problems/common/parallel.h"
#include "problems/vgd/make_segment.h"

namespace trueline {

SegmentChain::SegmentChain(const VgdOptions& options)
    : options_(options), scaling_(options), problem_(ProblemOptions(this)) {}

void SegmentChain::AddTheta() {
  x_.theta.emplace_back(ThetaVector::Zero());
  problem_.AddParameterBlock(x_.theta.back().data(), kThetaSize);
}

void SegmentChain::AddSegment(std::unique_ptr<Segment> segment, bool linked) {
  segments_.push_back(std::move(segment));
  theta_of_.push_back(x_.theta.size() - 1);
  linked_.push_back(linked);
  residuals_.emplace_back();
  x_.nodes.emplace_back(NodeVector::Zero());
  problem_.AddParameterBlock(x_.nodes.back().data(), kGustAt);
  if (HasGusts()) problem_.AddParameterBlock(x_.nodes.back().data() + kGustAt, kGustSize);
}

Gusts SegmentChain::GustsOf(std::size_t s) const {
  if (!HasGusts()) return Gusts::kNone;
  return IsLinked(s) ? Gusts::kLinked : Gusts::kHeld;
}

GustSlope<6> SegmentChain::StateGusts(std::size_t s, TimeNs t) const {
  return {GustsOf(s), segments_[s]->StateGustsAt(t)};
}

GustSlope<2> SegmentChain::ForceGusts(std::size_t s, TimeNs t) const {
  return {GustsOf(s), segments_[s]->ForceGustsAt(t)};
}

std::vector<double*> SegmentChain::NodeBlocks(std::size_t s) {
  std::vector<double*> blocks{x_.nodes[s].data()};
  if (HasGusts()) blocks.push_back(x_.nodes[s].data() + kGustAt);
  return blocks;
}

ceres::ResidualBlockId SegmentChain::AddReading(std::size_t s, ceres::CostFunction* cost,
                                                ceres::LossFunction* loss,
                                                const std::vector<double*>& own) {
  std::vector<double*> blocks = NodeBlocks(s);
  blocks.insert(blocks.begin(), x_.theta[theta_of_[s]].data());
  if (GustsOf(s) == Gusts::kLinked) blocks.push_back(NodeBlocks(s + 1).back());
  blocks.insert(blocks.end(), own.begin(), own.end());
  residuals_[s].push_back(problem_.AddResidualBlock(cost, loss, blocks));
  return residuals_[s].back();
}

void SegmentChain::AddForce(std::size_t s, const ForceSample& force, double sigma) {
  has_forces_ = true;
  AddReading(s,
             new DragResidual(segments_[s]->ForceAt(force.t), {force.accel_xy, sigma},
                              ForceGusts(s, force.t)),
             new ceres::HuberLoss(2.5));
}

void SegmentChain::AddStep(std::size_t s, double gravity) {
  const Segment& segment = *segments_[s];
  const double seconds = SecondsBetween(segment.start(), segment.end());
  const ContinuityResidual::Weights weights =
      StepWeights(options_.process, scaling_.DriftUnit(), seconds, gravity);
  log_weights_ += LogDeterminant(weights, HasGusts());
  std::vector<double*> blocks{x_.theta[theta_of_[s]].data(), x_.nodes[s].data(),
                              x_.nodes[s + 1].data()};
  if (HasGusts()) {
    blocks.insert(blocks.end(), {NodeBlocks(s).back(), NodeBlocks(s + 1).back()});
  }
  residuals_[s].push_back(problem_.AddResidualBlock(
      new ContinuityResidual(segment.end_node(), weights, StateGusts(s, segment.end())), nullptr,
      blocks));
}

std::vector<ceres::ResidualBlockId> SegmentChain::AddStart(std::size_t s) {
  const Eigen::Vector3d drift = options_.process.DriftSigma().cwiseMax(1e-5);
  Eigen::Matrix<double, kGustAt, 1> weight = Eigen::Matrix<double, kGustAt, 1>::Zero();
  weight.head<kDriftSize>() = scaling_.DriftUnit().cwiseQuotient(drift);
  log_weights_ -= drift.array().log().sum();
  std::vector<ceres::ResidualBlockId> priors{AddPrior(x_.nodes[s].data(), weight)};
  if (!HasGusts()) return priors;
  log_weights_ -= kGustSize * std::log(options_.process.gust);
  priors.push_back(
      AddPrior(NodeBlocks(s).back(), Eigen::Vector2d::Constant(1.0 / options_.process.gust)));
  return priors;
}

ceres::ResidualBlockId SegmentChain::AddPrior(double* block, const Eigen::VectorXd& weight) {
  return problem_.AddResidualBlock(new ceres::NormalPrior(Eigen::MatrixXd(weight.asDiagonal()),
                                                          Eigen::VectorXd::Zero(weight.size())),
                                   nullptr, block);
}

void SegmentChain::SetBounds() {
  for (ThetaVector& theta : x_.theta) {
    for (int i = 0; i < kMotionSize; ++i) {
      const ParameterPrior& prior = options_.priors[i];
      problem_.SetParameterLowerBound(theta.data(), i, (prior.lower - prior.mean) / prior.sigma);
      problem_.SetParameterUpperBound(theta.data(), i, (prior.upper - prior.mean) / prior.sigma);
    }
  }
}

void SegmentChain::HoldDrift(std::size_t s) {
  problem_.SetManifold(x_.nodes[s].data(), new ceres::SubsetManifold(kGustAt, {0, 1, 2}));
}

std::size_t SegmentChain::SegmentAt(TimeNs t, std::size_t first, std::size_t end) const {
  const auto after = std::upper_bound(
      segments_.begin() + static_cast<long>(first) + 1, segments_.begin() + static_cast<long>(end),
      t, [](TimeNs time, const auto& segment) { return time < segment->start(); });
  return static_cast<std::size_t>(after - segments_.begin()) - 1;
}

void SegmentChain::SetState(std::size_t s, const Eigen::Vector3d& p, const Eigen::Vector3d& v) {
  x_.nodes[s].setZero();
  x_.nodes[s].segment<kStateSize>(kStateAt) << p, v;
}

void SegmentChain::PrepareForEvaluation(bool evaluate_jacobians, bool /*new_evaluation_point*/) {
  Refresh(evaluate_jacobians);
}

// Ceres evaluates the same point repeatedly (with bounds, it announces it as new each time).
void SegmentChain::Refresh(bool derivatives) {
  if (x_ == integrated_ && (has_derivatives_ || !derivatives)) return;
  constexpr int kInARow = 64;  // segments; a window has fewer and stays on its thread
  ParallelRuns(static_cast<int>(segments_.size()), kInARow,
               [&](int s) { Integrate(static_cast<std::size_t>(s), derivatives); });
  integrated_ = x_;
  has_derivatives_ = derivatives;
}

void SegmentChain::Integrate(std::size_t s) { Integrate(s, false); }

void SegmentChain::Integrate(std::size_t s, bool derivatives) {
  const NodeVector& node = x_.nodes[s];
  segments_[s]->Evaluate(x_.theta[theta_of_[s]].data(), node.data(), node.data() + kStateAt,
                         derivatives);
  if (!HasGusts()) return;
  GustPair gusts;
  gusts << node.tail<kGustSize>(), x_.nodes[IsLinked(s) ? s + 1 : s].tail<kGustSize>();
  segments_[s]->AddGusts(gusts);
}

ceres::Solver::Summary SegmentChain::Solve(const ceres::Solver::Options& options) {
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  Refresh(true);
  return summary;
}

}  // namespace trueline
