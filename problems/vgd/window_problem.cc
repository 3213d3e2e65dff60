#include "problems/vgd/window_problem.h"

#include <ceres/normal_prior.h>
#include <glog/logging.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "cost_functions/continuity_residual.h"
#include "cost_functions/drag_residual.h"
#include "cost_functions/fix_residual.h"
#include "cost_functions/norm_loss.h"

namespace trueline {
namespace {

bool HasProcessNoise(const ProcessNoise& noise) {
  return noise.acceleration > 0.0 || noise.tilt > 0.0 || noise.heading > 0.0;
}

ceres::Problem::Options ProblemOptions(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.evaluation_callback = callback;
  return options;
}

// One instance serves one residual block, which owns it.
ceres::LossFunction* MakeLoss(const VgdOptions& options) {
  switch (options.loss) {
    case FixLoss::kHuber:
      return new ceres::HuberLoss(options.loss_scale);
    case FixLoss::kCauchy:
      return new ceres::CauchyLoss(options.loss_scale);
    case FixLoss::kNorm:
      return new NormLoss();
    case FixLoss::kNone:
      break;
  }
  return nullptr;
}

// A floor far below anything that matters keeps the covariance regular where one of the processes
// is switched off: 1 mm, 1 mm/s, 0.0006 deg.
Matrix9d SqrtInformation(const ProcessNoise& noise, double seconds, double gravity) {
  Matrix9d cov = ProcessCovariance(noise, seconds, gravity);
  cov.diagonal().head<6>().array() += 1e-6;
  cov.diagonal().tail<3>().array() += 1e-10;
  const Matrix9d L = cov.llt().matrixL();
  return L.triangularView<Eigen::Lower>().solve(Matrix9d::Identity());
}

}  // namespace

WindowProblem::WindowProblem(const DriveTrack& track, const WindowData& data,
                             const VgdOptions& options)
    : options_(options), scaling_(options), problem_(ProblemOptions(this)) {
  BuildSegments(track, data);
  AddFixes(data);
  AddForces(data);
  AddContinuity(track.gravity());
  AddPriors();
  if (options_.solver == VgdSolver::kTrustRegion) SetBounds();
}

void WindowProblem::BuildSegments(const DriveTrack& track, const WindowData& data) {
  const double span = SecondsBetween(data.begin, data.end);
  const int count = HasProcessNoise(options_.process)
                        ? std::max(1, static_cast<int>(std::ceil(span / options_.knot_interval)))
                        : 1;
  std::size_t fix = 0, force = 0;
  for (int s = 0; s < count; ++s) {
    const TimeNs from = data.begin + (data.end - data.begin) * s / count;
    const TimeNs to = data.begin + (data.end - data.begin) * (s + 1) / count;
    std::vector<TimeNs> times{to}, force_times;
    for (; fix < data.fixes.size() && data.fixes[fix].t <= to; ++fix) {
      times.push_back(data.fixes[fix].t);
    }
    for (; force < data.forces.size() && data.forces[force].t <= to; ++force) {
      times.push_back(data.forces[force].t);
      force_times.push_back(data.forces[force].t);
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    segments_.push_back(std::make_unique<Segment>(track, from, std::move(times), force_times,
                                                  scaling_, options_.max_block));
  }
  x_.body.setZero();
  x_.ahrs.assign(count, Eigen::Vector3d::Zero());
  x_.states.assign(count, Eigen::Matrix<double, 6, 1>::Zero());
  problem_.AddParameterBlock(x_.body.data(), kBodySize);
  for (int s = 0; s < count; ++s) {
    problem_.AddParameterBlock(x_.ahrs[s].data(), kAhrsSize);
    problem_.AddParameterBlock(x_.states[s].data(), kStateSize);
  }
}

std::size_t WindowProblem::SegmentOf(TimeNs t) const {
  const auto it = std::find_if(segments_.begin(), segments_.end(),
                               [&](const auto& segment) { return t <= segment->end(); });
  CHECK(it != segments_.end());
  return static_cast<std::size_t>(it - segments_.begin());
}

void WindowProblem::AddFixes(const WindowData& data) {
  for (const Fix& fix : data.fixes) {
    const std::size_t s = SegmentOf(fix.t);
    const double sigma = options_.whiten ? fix.sigma : 1.0;
    problem_.AddResidualBlock(new FixResidual(segments_[s]->StateAt(fix.t), fix.p_E, sigma),
                              MakeLoss(options_), x_.body.data(), x_.ahrs[s].data(),
                              x_.states[s].data());
  }
}

void WindowProblem::AddForces(const WindowData& data) {
  if (!options_.drag_measurement.enabled) return;
  for (const ForceSample& force : data.forces) {
    const std::size_t s = SegmentOf(force.t);
    force_blocks_.push_back(problem_.AddResidualBlock(
        new DragResidual(segments_[s]->ForceAt(force.t), force.accel_xy, data.force_sigma),
        new ceres::HuberLoss(2.5), x_.body.data(), x_.ahrs[s].data(), x_.states[s].data()));
  }
}

void WindowProblem::AddContinuity(double gravity) {
  for (std::size_t s = 0; s + 1 < segments_.size(); ++s) {
    const double seconds = SecondsBetween(segments_[s]->start(), segments_[s]->end());
    problem_.AddResidualBlock(
        new ContinuityResidual(segments_[s]->end_node(), scaling_.ahrs_sigma,
                               SqrtInformation(options_.process, seconds, gravity)),
        nullptr, x_.body.data(), x_.ahrs[s].data(), x_.states[s].data(), x_.ahrs[s + 1].data(),
        x_.states[s + 1].data());
  }
}

void WindowProblem::AddPriors() {
  problem_.AddResidualBlock(
      new ceres::NormalPrior(Eigen::MatrixXd::Identity(kBodySize, kBodySize),
                             Eigen::VectorXd::Zero(kBodySize)),
      nullptr, x_.body.data());
  problem_.AddResidualBlock(
      new ceres::NormalPrior(Eigen::MatrixXd::Identity(kAhrsSize, kAhrsSize),
                             Eigen::VectorXd::Zero(kAhrsSize)),
      nullptr, x_.ahrs.front().data());
}

void WindowProblem::SetBounds() {
  const auto set = [this](double* block, int index, const ParameterPrior& prior) {
    problem_.SetParameterLowerBound(block, index, (prior.lower - prior.mean) / prior.sigma);
    problem_.SetParameterUpperBound(block, index, (prior.upper - prior.mean) / prior.sigma);
  };
  for (int i = 0; i < 3; ++i) {
    set(x_.body.data(), i, options_.priors[i]);
    set(x_.body.data(), 3 + i, options_.priors[6 + i]);
    for (Eigen::Vector3d& ahrs : x_.ahrs) set(ahrs.data(), i, options_.priors[3 + i]);
  }
}

void WindowProblem::SetStart(const Theta& theta, const Eigen::Matrix<double, 6, 1>& state) {
  constexpr int kFromTheta[6] = {0, 1, 2, 6, 7, 8};
  x_.body.setZero();
  for (int i = 0; i < 6; ++i) {
    x_.body[i] = (theta[kFromTheta[i]] - scaling_.body_mean[i]) / scaling_.body_sigma[i];
  }
  const Eigen::Vector3d ahrs =
      (theta.segment<3>(3) - scaling_.ahrs_mean).cwiseQuotient(scaling_.ahrs_sigma);
  Eigen::Matrix<double, 6, 1> x = state;
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    x_.ahrs[s] = ahrs;
    x_.states[s] = x;
    segments_[s]->Evaluate(x_.body.data(), ahrs.data(), x.data(), false);
    x = segments_[s]->end_node()->value;
  }
}

void WindowProblem::PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) {
  if (new_evaluation_point || evaluate_jacobians) Refresh(evaluate_jacobians);
}

void WindowProblem::Refresh(bool derivatives) {
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    segments_[s]->Evaluate(x_.body.data(), x_.ahrs[s].data(), x_.states[s].data(), derivatives);
  }
}

ceres::Solver::Summary WindowProblem::Solve() {
  ceres::Solver::Options options;
  options.max_num_iterations = options_.max_iterations;
  options.function_tolerance = options_.tolerance;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  if (options_.solver == VgdSolver::kGradientDescent) {
    options.minimizer_type = ceres::LINE_SEARCH;
    options.line_search_direction_type = ceres::STEEPEST_DESCENT;
  } else {
    options.linear_solver_type =
        segments_.size() > 1 ? ceres::SPARSE_NORMAL_CHOLESKY : ceres::DENSE_NORMAL_CHOLESKY;
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  Refresh(true);
  return summary;
}

Eigen::Matrix<double, WindowProblem::kParameters, 1> WindowProblem::Parameters() const {
  const Eigen::Matrix<double, kBodySize, 1> body =
      scaling_.body_mean + scaling_.body_sigma.cwiseProduct(x_.body);
  Eigen::Matrix<double, kParameters, 1> parameters;
  parameters << body.head<3>(),
      scaling_.ahrs_mean + scaling_.ahrs_sigma.cwiseProduct(x_.ahrs.back()), body.tail<5>();
  return parameters;
}

Eigen::Vector3d WindowProblem::PositionAt(TimeNs t) const {
  return segments_[SegmentOf(t)]->StateAt(t)->value.head<3>();
}

}  // namespace trueline
