// Evidence and covariance at the optimum of a ceres::Problem, by the Gauss-Newton Hessian.
#pragma once

#include <ceres/problem.h>

#include <Eigen/SparseCholesky>
#include <map>
#include <vector>

namespace trueline {

class GaussNewton {
 public:
  // The Hessian at the current unknowns over `blocks`, in that order; robust losses included.
  GaussNewton(ceres::Problem* problem, const std::vector<double*>& blocks);
  GaussNewton(const GaussNewton&) = delete;
  GaussNewton& operator=(const GaussNewton&) = delete;

  Eigen::Index size() const { return hessian_.rows(); }
  // The block's first row and column.
  Eigen::Index At(const double* block) const { return first_.at(block); }
  // Log of the determinant.
  double LogDeterminant() const;
  // H^-1 G. For a singular H the pseudo-inverse by eigenvalues: an open direction gives zero change
  // instead of infinity.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& G) const;

 private:
  Eigen::SparseMatrix<double> hessian_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
  std::map<const double*, Eigen::Index> first_;
};

// Log marginal likelihood by Laplace's approximation at the current unknowns, up to a constant;
// `log_weights`: sum of the log determinants of what whitens.
double LaplaceEvidence(ceres::Problem* problem, const std::vector<double*>& blocks,
                       double log_weights);

}  // namespace trueline
