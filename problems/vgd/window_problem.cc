#include "problems/vgd/window_problem.h"

#include <ceres/normal_prior.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "cost_functions/continuity_residual.h"
#include "cost_functions/drag_residual.h"
#include "cost_functions/fix_residual.h"
#include "cost_functions/offset_fix_residual.h"
#include "cost_functions/window_prior_residual.h"
#include "problems/common/ceres_problem.h"
#include "problems/vgd/fix_loss.h"
#include "problems/vgd/make_segment.h"
#include "problems/vgd/solver_options.h"

namespace trueline {
namespace {}  // namespace

WindowProblem::WindowProblem(const DriveTrack& track, const WindowData& data,
                             const VgdOptions& options, const std::optional<WindowPrior>& past)
    : options_(options), scaling_(options), problem_(ProblemOptions(this)) {
  BuildSegments(track, data);
  AddOffsets(data);
  AddFixes(data);
  AddForces(data);
  AddContinuity(track.gravity());
  if (past) {
    AddPast(*past);
  } else {
    AddPriors();
  }
  if (options_.solver == VgdSolver::kTrustRegion) SetBounds();
}

// Knots are at the passes' begins and evenly between, so that the past can be marginalised at a
// pass.
void WindowProblem::BuildSegments(const DriveTrack& track, const WindowData& data) {
  std::vector<TimeNs> cuts{data.begin};
  if (options_.process.Any()) {
    for (const Pass& pass : data.passes.subspan(1)) cuts.push_back(pass.begin);
  }
  cuts.push_back(data.end);
  const double interval =
      options_.process.Any() ? options_.knot_interval : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const std::vector<TimeNs> knots = EvenKnots(cuts[i], cuts[i + 1], interval);
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
      segments_.push_back(
          MakeSegment(track, data, knots[k], knots[k + 1], scaling_, options_.max_block));
    }
  }
  const std::size_t count = segments_.size();
  x_.theta.setZero();
  x_.drift.assign(count, Eigen::Vector3d::Zero());
  x_.states.assign(count, Eigen::Matrix<double, 6, 1>::Zero());
  segment_blocks_.resize(count);
  problem_.AddParameterBlock(x_.theta.data(), kThetaSize);
  for (std::size_t s = 0; s < count; ++s) {
    problem_.AddParameterBlock(x_.drift[s].data(), kDriftSize);
    problem_.AddParameterBlock(x_.states[s].data(), kStateSize);
  }
  if (!options_.UsesGusts()) return;
  x_.gusts.assign(count, Eigen::Vector2d::Zero());
  std::vector<bool> linked(count, true);
  linked.back() = false;
  gusts_ = GustBlocks(options_.process, std::move(linked), &x_.gusts, &problem_);
}

std::size_t WindowProblem::SegmentOf(TimeNs t) const {
  const auto after =
      std::upper_bound(segments_.begin(), segments_.end(), t,
                       [](TimeNs time, const auto& segment) { return time < segment->start(); });
  CHECK(after != segments_.begin() && t <= segments_.back()->end());
  return static_cast<std::size_t>(after - segments_.begin()) - 1;
}

void WindowProblem::AddOffsets(const WindowData& data) {
  for (const PassOffset& offset : data.offsets) {
    const Pass& pass = data.passes[offset.pass];
    offsets_.push_back({pass.begin, pass.end, Eigen::Matrix<double, 6, 1>::Zero(), nullptr});
  }
  for (std::size_t i = 0; i < offsets_.size(); ++i) {
    Eigen::Matrix<double, 6, 1> weight;
    weight.head<3>().setConstant(1.0 / data.offsets[i].sigma);
    weight.tail<3>().setConstant(1.0 / data.offsets[i].rate_sigma);
    log_weights_ += weight.array().log().sum();
    offsets_[i].prior = problem_.AddResidualBlock(
        new ceres::NormalPrior(weight.asDiagonal(), Eigen::VectorXd::Zero(6)), nullptr,
        offsets_[i].value.data());
  }
}

void WindowProblem::AddFixes(const WindowData& data) {
  auto offset = offsets_.begin();
  for (const Fix& fix : data.fixes) {
    const std::size_t s = SegmentOf(fix.t);
    const StateNode* node = segments_[s]->StateAt(fix.t);
    const double sigma = options_.whiten ? fix.sigma : 1.0;
    std::vector<double*> unknowns{x_.theta.data(), x_.drift[s].data(), x_.states[s].data()};
    while (offset != offsets_.end() && offset->end < fix.t) ++offset;
    ceres::CostFunction* residual = nullptr;
    if (offset != offsets_.end() && offset->begin <= fix.t) {
      const double elapsed = SecondsBetween(offset->begin, fix.t);
      residual = new OffsetFixResidual(node, fix.p_E, sigma, elapsed);
      unknowns.push_back(offset->value.data());
    } else {
      residual = new FixResidual(node, fix.p_E, sigma);
    }
    segment_blocks_[s].push_back(
        gusts_.Add(&problem_, residual, MakeLoss(options_.loss, options_.loss_scale), unknowns, s,
                   segments_[s]->StateGustsAt(fix.t).topRows<3>() / sigma));
  }
}

void WindowProblem::AddForces(const WindowData& data) {
  if (!options_.drag_measurement.enabled) return;
  for (const ForceSample& force : data.forces) {
    const std::size_t s = SegmentOf(force.t);
    force_blocks_.push_back(gusts_.Add(
        &problem_,
        new DragResidual(segments_[s]->ForceAt(force.t), force.accel_xy, data.force_sigma),
        new ceres::HuberLoss(2.5), {x_.theta.data(), x_.drift[s].data(), x_.states[s].data()}, s,
        segments_[s]->ForceGustsAt(force.t) / data.force_sigma));
    segment_blocks_[s].push_back(force_blocks_.back());
  }
}

void WindowProblem::AddContinuity(double gravity) {
  for (std::size_t s = 0; s + 1 < segments_.size(); ++s) {
    const double seconds = SecondsBetween(segments_[s]->start(), segments_[s]->end());
    const Matrix9d sqrt_information = StepSqrtInformation(options_.process, seconds, gravity);
    log_weights_ += sqrt_information.diagonal().array().log().sum();  // log determinant of a
                                                                      // triangular matrix
    segment_blocks_[s].push_back(
        gusts_.Add(&problem_,
                   new ContinuityResidual(segments_[s]->end_node(), scaling_.DriftUnit(),
                                          options_.process.Decay(seconds), sqrt_information),
                   nullptr,
                   {x_.theta.data(), x_.drift[s].data(), x_.states[s].data(),
                    x_.drift[s + 1].data(), x_.states[s + 1].data()},
                   s, -sqrt_information.leftCols<6>() * StateByGusts(seconds, seconds)));
    if (!gusts_.Any()) continue;
    segment_blocks_[s].push_back(gusts_.AddStep(&problem_, s, seconds, &log_weights_));
  }
}

void WindowProblem::AddPriors() {
  prior_blocks_.push_back(problem_.AddResidualBlock(
      new ceres::NormalPrior(Eigen::MatrixXd::Identity(kThetaSize, kThetaSize),
                             Eigen::VectorXd::Zero(kThetaSize)),
      nullptr, x_.theta.data()));
  if (!options_.process.Any()) {
    problem_.SetParameterBlockConstant(x_.drift.front().data());
    return;
  }
  const Eigen::Vector3d sigma = options_.process.DriftSigma().cwiseMax(1e-5);
  log_weights_ -= sigma.array().log().sum();
  prior_blocks_.push_back(problem_.AddResidualBlock(
      new ceres::NormalPrior(scaling_.DriftUnit().cwiseQuotient(sigma).asDiagonal(),
                             Eigen::VectorXd::Zero(kDriftSize)),
      nullptr, x_.drift.front().data()));
  if (gusts_.Any()) prior_blocks_.push_back(gusts_.AddPrior(&problem_, 0, &log_weights_));
}

void WindowProblem::AddPast(const WindowPrior& past) {
  past_doubt_ = past.doubt;
  log_weights_ += past.sqrt_information.householderQr().logAbsDeterminant();
  std::vector<double*> blocks{x_.theta.data()};
  std::vector<int> sizes{kThetaSize};
  for (double* block : BlocksOf(0)) {
    blocks.push_back(block);
    sizes.push_back(problem_.ParameterBlockSize(block));
  }
  prior_blocks_.push_back(problem_.AddResidualBlock(
      new WindowPriorResidual(past.mean, past.sqrt_information, sizes), nullptr, blocks));
}

std::vector<double*> WindowProblem::BlocksOf(std::size_t segment) {
  std::vector<double*> blocks{x_.drift[segment].data(), x_.states[segment].data()};
  if (gusts_.Any()) blocks.push_back(gusts_.block(segment));
  return blocks;
}

void WindowProblem::SetBounds() {
  for (int i = 0; i < kMotionSize; ++i) {
    const ParameterPrior& prior = options_.priors[i];
    const double lower = (prior.lower - prior.mean) / prior.sigma;
    const double upper = (prior.upper - prior.mean) / prior.sigma;
    problem_.SetParameterLowerBound(x_.theta.data(), i, lower);
    problem_.SetParameterUpperBound(x_.theta.data(), i, upper);
  }
}

void WindowProblem::SetStart(const Theta& theta, const RoughPath& path) {
  x_.theta.setZero();
  x_.theta.head<kMotionSize>() =
      (theta - scaling_.mean.head<kMotionSize>()).cwiseQuotient(scaling_.sigma.head<kMotionSize>());
  for (Eigen::Vector2d& gust : x_.gusts) gust.setZero();
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    x_.drift[s].setZero();
    if (s == 0 || segments_[s]->start() <= path.end()) {
      const LineFit guess = path.At(segments_[s]->start());
      x_.states[s] << guess.p, guess.v;
    } else {
      Integrate(s - 1, false);
      x_.states[s] = segments_[s - 1]->end_node()->value;
    }
  }
}

void WindowProblem::PrepareForEvaluation(bool evaluate_jacobians, bool /*new_evaluation_point*/) {
  Refresh(evaluate_jacobians);
}

// Ceres evaluates the same point repeatedly (with bounds, it announces it as new each time).
void WindowProblem::Refresh(bool derivatives) {
  if (x_ == integrated_ && (has_derivatives_ || !derivatives)) return;
  for (std::size_t s = 0; s < segments_.size(); ++s) Integrate(s, derivatives);
  integrated_ = x_;
  has_derivatives_ = derivatives;
}

void WindowProblem::Integrate(std::size_t s, bool derivatives) {
  segments_[s]->Evaluate(x_.theta.data(), x_.drift[s].data(), x_.states[s].data(), derivatives);
  if (gusts_.Any()) segments_[s]->AddGusts(gusts_.At(s));
}

ceres::Solver::Summary WindowProblem::Solve() {
  const auto linear_solver =
      segments_.size() > 1 ? ceres::SPARSE_NORMAL_CHOLESKY : ceres::DENSE_NORMAL_CHOLESKY;
  ceres::Solver::Summary summary;
  ceres::Solve(SolverOptions(options_, linear_solver), &problem_, &summary);
  Refresh(true);
  return summary;
}

void WindowProblem::HoldParameters(bool hold) {
  if (hold) {
    problem_.SetParameterBlockConstant(x_.theta.data());
  } else {
    problem_.SetParameterBlockVariable(x_.theta.data());
  }
}

Eigen::Matrix<double, WindowProblem::kParameters, 1> WindowProblem::Parameters() const {
  return scaling_.mean + scaling_.sigma.cwiseProduct(x_.theta);
}

Eigen::Vector3d WindowProblem::PositionAt(TimeNs t) const {
  return segments_[SegmentOf(t)]->StateAt(t)->value.head<3>();
}

}  // namespace trueline
