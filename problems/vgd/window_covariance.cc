// Covariance of a window's solution by the Gauss-Newton Hessian at the optimum.
#include <glog/logging.h>

#include <Eigen/Dense>

#include "problems/chain/gauss_newton.h"
#include "problems/common/ceres_problem.h"
#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

// Marginalises the residuals r + J dx to the last unknowns, whose linearisation point is `at`: the
// lower right corner of the R factor of [J r]. (QR keeps digits that the normal equations' Schur
// complement loses.)
WindowPrior EliminateFirst(const Eigen::MatrixXd& J, const Eigen::VectorXd& r,
                           const Eigen::VectorXd& at) {
  const Eigen::Index n = at.size();
  const Eigen::Index cols = J.cols(), rows = std::max(J.rows(), cols);
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(rows, cols + 1);
  system.topRows(J.rows()) << J, r;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(system);
  WindowPrior prior;
  prior.sqrt_information =
      qr.matrixQR().block(cols - n, cols - n, n, n).triangularView<Eigen::Upper>();
  const Eigen::VectorXd rest = qr.matrixQR().block(cols - n, cols, n, 1);
  prior.mean = at - prior.sqrt_information.completeOrthogonalDecomposition().solve(rest);
  return prior;
}

}  // namespace

std::vector<double*> WindowProblem::Blocks() {
  std::vector<double*> blocks{chain_.theta().data()};
  for (Offset& offset : offsets_) blocks.push_back(offset.value.data());
  for (std::size_t s = 0; s < chain_.size(); ++s) {
    for (double* block : chain_.NodeBlocks(s)) blocks.push_back(block);
  }
  return blocks;
}

double WindowProblem::LogEvidence() {
  return LaplaceEvidence(&problem(), Blocks(), chain_.log_weights());
}

WindowPrior WindowProblem::Marginalise(TimeNs t) {
  std::size_t kept = 0;  // first segment that is kept
  while (kept < chain_.size() && chain_.segment(kept).start() < t) ++kept;
  CHECK(kept > 0 && kept < chain_.size() && chain_.segment(kept).start() == t);

  ceres::Problem::EvaluateOptions options;
  options.residual_blocks = priors_;
  for (Offset& offset : offsets_) {
    if (offset.begin >= t) continue;
    options.parameter_blocks.push_back(offset.value.data());
    options.residual_blocks.push_back(offset.prior);
  }
  for (std::size_t s = 0; s < kept; ++s) {
    for (double* block : chain_.NodeBlocks(s)) options.parameter_blocks.push_back(block);
    const auto& residuals = chain_.residuals(s);
    options.residual_blocks.insert(options.residual_blocks.end(), residuals.begin(),
                                   residuals.end());
  }
  options.parameter_blocks.push_back(chain_.theta().data());
  for (double* block : chain_.NodeBlocks(kept)) options.parameter_blocks.push_back(block);
  std::vector<double> residuals;
  ceres::CRSMatrix crs;
  problem().Evaluate(options, nullptr, &residuals, nullptr, &crs);
  Eigen::VectorXd at(kThetaSize + (chain_.HasGusts() ? kNodeSize : kGustAt));
  at << chain_.theta(), chain_.node(kept).head(at.size() - kThetaSize);
  WindowPrior prior = EliminateFirst(
      ToEigen(crs), Eigen::Map<const Eigen::VectorXd>(residuals.data(), residuals.size()), at);
  prior.doubt = past_doubt_;
  prior.doubt.Add(own_doubt_, static_cast<double>(kept) / static_cast<double>(chain_.size()));
  return prior;
}

namespace {

// Spacing of the sampled segments.
std::size_t Stride(std::size_t segments) {
  constexpr std::size_t kMost = 12;
  return 1 + (segments - 1) / kMost;
}

}  // namespace

// A sample of segments at even spacing at which the velocity's covariance is computed.
std::vector<std::size_t> WindowProblem::DoubtfulSegments() const {
  std::vector<std::size_t> chosen;
  if (!HasForces()) return chosen;
  for (std::size_t s = 0; s < chain_.size(); s += Stride(chain_.size())) {
    if (chain_.segment(s).force_count() > 0) chosen.push_back(s);
  }
  return chosen;
}

WindowProblem::Uncertainty WindowProblem::FindUncertainty() {
  const GaussNewton normal(&problem(), Blocks());
  // The requested quantities as linear functions of the unknowns: theta and the final state, then
  // the velocity along body x and y at the sampled segments' starts.
  constexpr int kAsked = kParameters + 6;
  const int state_at = options_.process.Any() ? kStateAt : 0;  // drift is held without process
  const std::size_t last = chain_.size() - 1;
  const Eigen::Index last_at = normal.At(chain_.node(last).data());
  const std::vector<std::size_t> doubtful = DoubtfulSegments();
  const StateNode& end = *chain_.segment(last).end_node();
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(normal.size(), kAsked + 2 * doubtful.size());
  G.topLeftCorner<kThetaSize, kThetaSize>().setIdentity();
  G.block<kThetaSize, 6>(0, kParameters) = end.d_theta.transpose();
  if (options_.process.Any()) {
    G.block<kDriftSize, 6>(last_at, kParameters) = end.d_drift().transpose();
  }
  G.block<kStateSize, 6>(last_at + state_at, kParameters) = end.d_state.transpose();
  if (chain_.HasGusts()) {
    G.block<kGustSize, 6>(normal.At(chain_.NodeBlocks(last).back()), kParameters) =
        chain_.StateGusts(last, chain_.segment(last).end()).Own().transpose();
  }
  for (std::size_t k = 0; k < doubtful.size(); ++k) {
    const Eigen::Index velocity_at = normal.At(chain_.node(doubtful[k]).data()) + state_at + 3;
    G.block<3, 2>(velocity_at, kAsked + 2 * k) = chain_.segment(doubtful[k]).BodyAxesAtStart();
  }
  const Eigen::MatrixXd X = normal.Solve(G);
  Uncertainty result;
  result.cov = G.leftCols<kAsked>().transpose() * X.leftCols<kAsked>();
  own_doubt_ = DragDoubt();
  for (std::size_t k = 0; k < doubtful.size(); ++k) {
    const Segment& segment = chain_.segment(doubtful[k]);
    const auto at = kAsked + 2 * k;
    const Eigen::Vector2d variance(G.col(at).dot(X.col(at)), G.col(at + 1).dot(X.col(at + 1)));
    const Eigen::Vector3d v_E = chain_.state(doubtful[k]).tail<3>();
    own_doubt_.Add(segment.BodyAxesAtStart().transpose() * v_E, variance,
                   static_cast<int>(Stride(chain_.size())) * segment.force_count());
  }
  result.doubt = past_doubt_;
  result.doubt.Add(own_doubt_);
  return result;
}

}  // namespace trueline
