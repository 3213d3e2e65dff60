#include "problems/chain/gauss_newton.h"

#include <Eigen/Dense>

#include "problems/common/ceres_problem.h"

namespace trueline {

GaussNewton::GaussNewton(ceres::Problem* problem, const std::vector<double*>& blocks) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks;
  ceres::CRSMatrix crs;
  problem->Evaluate(options, nullptr, nullptr, nullptr, &crs);
  const Eigen::SparseMatrix<double> J = ToEigen(crs);
  hessian_ = J.transpose() * J;
  factors_.compute(hessian_);
  Eigen::Index at = 0;
  for (const double* block : blocks) {
    first_[block] = at;
    at += problem->ParameterBlockTangentSize(block);
  }
}

double GaussNewton::LogDeterminant() const {
  return factors_.vectorD().cwiseMax(1e-300).array().log().sum();
}

Eigen::MatrixXd GaussNewton::Solve(const Eigen::MatrixXd& G) const {
  if (factors_.info() == Eigen::Success && factors_.vectorD().minCoeff() > 0.0) {
    return factors_.solve(G);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen{Eigen::MatrixXd(hessian_)};
  const double floor = 1e-13 * eigen.eigenvalues().maxCoeff();
  const Eigen::VectorXd inverse = eigen.eigenvalues().unaryExpr(
      [floor](double value) { return value > floor ? 1.0 / value : 0.0; });
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose() * G;
}

double LaplaceEvidence(ceres::Problem* problem, const std::vector<double*>& blocks,
                       double log_weights) {
  double cost = 0.0;
  problem->Evaluate(ceres::Problem::EvaluateOptions(), &cost, nullptr, nullptr, nullptr);
  return log_weights - cost - 0.5 * GaussNewton(problem, blocks).LogDeterminant();
}

}  // namespace trueline
