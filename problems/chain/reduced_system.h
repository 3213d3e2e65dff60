// A least-squares problem reduced to a few border unknowns: what is left of a linearised chain once
// its nodes are eliminated (bordered_chain.h).
#pragma once

#include <Eigen/Dense>
#include <vector>

namespace trueline {

// The cost over the border unknowns z is 1/2 z'Mz + b'z + rss/2, priors included. It is kept as
// Gram matrices of the whitened rows by cluster of time: residuals of real flights are correlated
// in time, so tests also use the scatter of scores between clusters.
class ReducedSystem {
 public:
  // Of independent priors on the border unknowns: 1/2 precision (z + error)^2; precision 0: none.
  struct Prior {
    Eigen::VectorXd precision, error;
  };

  ReducedSystem() = default;
  // `grams`: by cluster, border + 1 squared, the residual last. `log_det`: log determinant of the
  // nodes' normal matrix. `log_weights`: log determinant of what whitens the rows.
  ReducedSystem(std::vector<Eigen::MatrixXd> grams, Prior prior, double log_det,
                double log_weights);

  const Eigen::MatrixXd& M() const { return M_; }
  const Eigen::VectorXd& b() const { return b_; }
  int border() const { return static_cast<int>(b_.size()); }
  int clusters() const { return static_cast<int>(grams_.size()); }

  // The border unknowns of least cost, and that solution followed by 1, which multiplies the
  // residual: the border values at which the chain's rows are the fit's residuals.
  Eigen::VectorXd Solution() const;
  Eigen::VectorXd Fitted() const;
  // Inverse of M.
  Eigen::MatrixXd Covariance() const;

  // For each cluster the sum over its rows of e_i v_i: e are the whitened residuals at the border
  // values `e` (border() + 1 numbers), v the rows at each column of `v`. Clusters x columns of v.
  Eigen::MatrixXd ClusterProducts(const Eigen::VectorXd& e, const Eigen::MatrixXd& v) const;

  // Log marginal likelihood up to a constant: the first `integrated` border unknowns are integrated
  // out, the others are at their optimum. -1e300 where M is not positive definite.
  double LogEvidence(int integrated) const;
  // Its part without the cost: weights and determinants.
  double LogDeterminants(int integrated) const;

  // The same system from the given clusters only; the priors count once.
  ReducedSystem Only(const std::vector<bool>& used) const;
  // The same system with the given border unknowns only, in that order; all others are zero.
  ReducedSystem Select(const std::vector<int>& kept) const;

 private:
  std::vector<Eigen::MatrixXd> grams_;
  Prior prior_;
  Eigen::MatrixXd M_;
  Eigen::VectorXd b_;
  double rss_ = 0.0, log_det_ = 0.0, log_weights_ = 0.0;
};

}  // namespace trueline
