// Covariance of a window's solution by the Gauss-Newton Hessian at the optimum.
#include <Eigen/Dense>
#include <Eigen/SparseCholesky>

#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

Eigen::SparseMatrix<double> ToEigen(const ceres::CRSMatrix& crs) {
  using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor> view(crs.num_rows, crs.num_cols,
                                        static_cast<int>(crs.values.size()), crs.rows.data(),
                                        crs.cols.data(), crs.values.data());
  return view;
}

// H^-1 G for a positive definite H; where H is singular, its pseudo-inverse by eigenvalues, so
// that an open direction gives zero change instead of infinity (the prior, which is part of H,
// holds every parameter; what can be open is only a state that no fix ever touched).
Eigen::MatrixXd SolveHessian(const Eigen::SparseMatrix<double>& H, const Eigen::MatrixXd& G) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(H);
  if (ldlt.info() == Eigen::Success && ldlt.vectorD().minCoeff() > 0.0) return ldlt.solve(G);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen{Eigen::MatrixXd(H)};
  const double floor = 1e-13 * eigen.eigenvalues().maxCoeff();
  const Eigen::VectorXd inverse = eigen.eigenvalues().unaryExpr(
      [floor](double value) { return value > floor ? 1.0 / value : 0.0; });
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose() * G;
}

}  // namespace

Eigen::SparseMatrix<double> WindowProblem::Hessian() {
  ceres::Problem::EvaluateOptions options;
  const bool drifts = options_.process.Any();
  options.parameter_blocks.push_back(x_.theta.data());
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    if (drifts) options.parameter_blocks.push_back(x_.drift[s].data());
    options.parameter_blocks.push_back(x_.states[s].data());
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

Eigen::Matrix<double, WindowProblem::kParameters + 6, WindowProblem::kParameters + 6>
WindowProblem::Covariance() {
  const Eigen::SparseMatrix<double> H = Hessian();
  // What is asked for, as linear functions of the unknowns: theta and the final state.
  constexpr int kAsked = kParameters + 6;
  const int last_state = static_cast<int>(H.cols()) - kStateSize;
  const StateNode& end = *segments_.back()->end_node();
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(H.cols(), kAsked);
  G.topLeftCorner<kThetaSize, kThetaSize>().setIdentity();
  G.block<kThetaSize, 6>(0, kParameters) = end.d_theta.transpose();
  if (options_.process.Any()) {
    G.block<kDriftSize, 6>(last_state - kDriftSize, kParameters) = end.d_drift().transpose();
  }
  G.block<kStateSize, 6>(last_state, kParameters) = end.d_state.transpose();
  return G.transpose() * SolveHessian(H, G);
}

}  // namespace trueline
