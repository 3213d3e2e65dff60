// Covariance of a window's solution by the Gauss-Newton Hessian at the optimum.
#include <glog/logging.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>

#include "problems/common/ceres_problem.h"
#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

// H^-1 G for a positive definite H. For a singular H the pseudo-inverse by eigenvalues: an open
// direction gives zero change instead of infinity. The prior is part of H and bounds every
// parameter, so only a state that no fix constrains can be open.
Eigen::MatrixXd SolveHessian(const Eigen::SparseMatrix<double>& H, const Eigen::MatrixXd& G) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(H);
  if (ldlt.info() == Eigen::Success && ldlt.vectorD().minCoeff() > 0.0) return ldlt.solve(G);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen{Eigen::MatrixXd(H)};
  const double floor = 1e-13 * eigen.eigenvalues().maxCoeff();
  const Eigen::VectorXd inverse = eigen.eigenvalues().unaryExpr(
      [floor](double value) { return value > floor ? 1.0 / value : 0.0; });
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose() * G;
}

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

Eigen::SparseMatrix<double> WindowProblem::Hessian() {
  ceres::Problem::EvaluateOptions options;
  const bool drifts = options_.process.Any();
  options.parameter_blocks.push_back(x_.theta.data());
  for (Offset& offset : offsets_) options.parameter_blocks.push_back(offset.value.data());
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    const std::vector<double*> blocks = BlocksOf(s);
    options.parameter_blocks.insert(options.parameter_blocks.end(),
                                    drifts ? blocks.begin() : blocks.begin() + 1, blocks.end());
  }
  ceres::CRSMatrix crs;
  problem_.Evaluate(options, nullptr, nullptr, nullptr, &crs);
  const Eigen::SparseMatrix<double> J = ToEigen(crs);
  return J.transpose() * J;
}

double WindowProblem::LogEvidence() {
  double cost = 0.0;
  problem_.Evaluate(ceres::Problem::EvaluateOptions(), &cost, nullptr, nullptr, nullptr);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(Hessian());
  const double log_det = ldlt.vectorD().cwiseMax(1e-300).array().log().sum();
  return log_weights_ - cost - 0.5 * log_det;
}

WindowPrior WindowProblem::Marginalise(TimeNs t) {
  std::size_t kept = 0;  // first segment that is kept
  while (kept < segments_.size() && segments_[kept]->start() < t) ++kept;
  CHECK(kept > 0 && kept < segments_.size() && segments_[kept]->start() == t);

  ceres::Problem::EvaluateOptions options;
  options.residual_blocks = prior_blocks_;
  for (Offset& offset : offsets_) {
    if (offset.begin >= t) continue;
    options.parameter_blocks.push_back(offset.value.data());
    options.residual_blocks.push_back(offset.prior);
  }
  for (std::size_t s = 0; s < kept; ++s) {
    const std::vector<double*> blocks = BlocksOf(s);
    options.parameter_blocks.insert(options.parameter_blocks.end(), blocks.begin(), blocks.end());
    options.residual_blocks.insert(options.residual_blocks.end(), segment_blocks_[s].begin(),
                                   segment_blocks_[s].end());
  }
  options.parameter_blocks.push_back(x_.theta.data());
  Eigen::VectorXd at = x_.theta;
  for (double* block : BlocksOf(kept)) {
    options.parameter_blocks.push_back(block);
    const int size = problem_.ParameterBlockSize(block);
    at.conservativeResize(at.size() + size);
    at.tail(size) = Eigen::Map<const Eigen::VectorXd>(block, size);
  }
  std::vector<double> residuals;
  ceres::CRSMatrix crs;
  problem_.Evaluate(options, nullptr, &residuals, nullptr, &crs);
  WindowPrior prior = EliminateFirst(
      ToEigen(crs), Eigen::Map<const Eigen::VectorXd>(residuals.data(), residuals.size()), at);
  prior.doubt = past_doubt_;
  prior.doubt.Add(own_doubt_, static_cast<double>(kept) / static_cast<double>(segments_.size()));
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
  for (std::size_t s = 0; s < segments_.size(); s += Stride(segments_.size())) {
    if (segments_[s]->force_count() > 0) chosen.push_back(s);
  }
  return chosen;
}

WindowProblem::Uncertainty WindowProblem::FindUncertainty() {
  const Eigen::SparseMatrix<double> H = Hessian();
  // The requested quantities as linear functions of the unknowns: theta and the final state, then
  // the velocity along body x and y at the sampled segments' starts.
  constexpr int kAsked = kParameters + 6;
  const int size = (options_.process.Any() ? kDriftSize : 0) + kStateSize +
                   (gusts_.Any() ? kGustSize : 0);  // of a segment's unknowns
  const int first = static_cast<int>(H.cols() - size * segments_.size());
  const int state_at = options_.process.Any() ? kDriftSize : 0;
  const int last_state = first + size * static_cast<int>(segments_.size() - 1) + state_at;
  const std::vector<std::size_t> doubtful = DoubtfulSegments();
  const StateNode& end = *segments_.back()->end_node();
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(H.cols(), kAsked + 2 * doubtful.size());
  G.topLeftCorner<kThetaSize, kThetaSize>().setIdentity();
  G.block<kThetaSize, 6>(0, kParameters) = end.d_theta.transpose();
  if (options_.process.Any()) {
    G.block<kDriftSize, 6>(last_state - kDriftSize, kParameters) = end.d_drift().transpose();
  }
  G.block<kStateSize, 6>(last_state, kParameters) = end.d_state.transpose();
  if (gusts_.Any()) {  // constant to the segment's end
    const auto d = segments_.back()->StateGustsAt(segments_.back()->end());
    G.block<kGustSize, 6>(last_state + kStateSize, kParameters) =
        (d.leftCols<kGustSize>() + d.rightCols<kGustSize>()).transpose();
  }
  for (std::size_t k = 0; k < doubtful.size(); ++k) {
    const int velocity_at = first + size * static_cast<int>(doubtful[k]) + state_at + 3;
    G.block<3, 2>(velocity_at, kAsked + 2 * k) = segments_[doubtful[k]]->BodyAxesAtStart();
  }
  const Eigen::MatrixXd X = SolveHessian(H, G);
  Uncertainty result;
  result.cov = G.leftCols<kAsked>().transpose() * X.leftCols<kAsked>();
  own_doubt_ = DragDoubt();
  for (std::size_t k = 0; k < doubtful.size(); ++k) {
    const Segment& segment = *segments_[doubtful[k]];
    const auto at = kAsked + 2 * k;
    const Eigen::Vector2d variance(G.col(at).dot(X.col(at)), G.col(at + 1).dot(X.col(at + 1)));
    const Eigen::Vector3d v_E = x_.states[doubtful[k]].tail<3>();
    own_doubt_.Add(segment.BodyAxesAtStart().transpose() * v_E, variance,
                   static_cast<int>(Stride(segments_.size())) * segment.force_count());
  }
  result.doubt = past_doubt_;
  result.doubt.Add(own_doubt_);
  return result;
}

}  // namespace trueline
