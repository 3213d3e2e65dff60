// A least-squares problem reduced to a few border unknowns: what is left of a linearised chain once
// its nodes are eliminated (bordered_chain.h).
#pragma once

#include <Eigen/Dense>
#include <utility>
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
  ReducedSystem(std::vector<Eigen::MatrixXd> grams, Prior prior, double log_det, double log_weights)
      : grams_(std::move(grams)),
        prior_(std::move(prior)),
        log_det_(log_det),
        log_weights_(log_weights) {
    const Eigen::Index border = prior_.precision.size();
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(border + 1, border + 1);
    for (const Eigen::MatrixXd& gram : grams_) sum += gram;
    M_ = sum.topLeftCorner(border, border);
    b_ = sum.col(border).head(border);
    M_.diagonal() += prior_.precision;
    b_ += prior_.precision.cwiseProduct(prior_.error);
    rss_ = sum(border, border) + prior_.precision.dot(prior_.error.cwiseAbs2());
  }

  const Eigen::MatrixXd& M() const { return M_; }
  const Eigen::VectorXd& b() const { return b_; }
  int border() const { return static_cast<int>(b_.size()); }
  int clusters() const { return static_cast<int>(grams_.size()); }

  // The border unknowns of least cost, and that solution followed by 1, which multiplies the
  // residual: the border values at which the chain's rows are the fit's residuals.
  Eigen::VectorXd Solution() const { return -M_.ldlt().solve(b_); }
  Eigen::VectorXd Fitted() const {
    Eigen::VectorXd fitted(border() + 1);
    fitted << Solution(), 1.0;
    return fitted;
  }
  // Inverse of M.
  Eigen::MatrixXd Covariance() const {
    return M_.ldlt().solve(Eigen::MatrixXd::Identity(border(), border()));
  }

  // For each cluster the sum over its rows of e_i v_i: e are the whitened residuals at the border
  // values `e` (border() + 1 numbers), v the rows at each column of `v`. Clusters x columns of v.
  Eigen::MatrixXd ClusterProducts(const Eigen::VectorXd& e, const Eigen::MatrixXd& v) const {
    // Tests of one of many columns leave most rows zero.
    std::vector<int> rows, columns;
    for (int i = 0; i < static_cast<int>(e.size()); ++i) {
      if (e[i] != 0.0) columns.push_back(i);
      if ((v.row(i).array() != 0.0).any()) rows.push_back(i);
    }
    const Eigen::VectorXd right = e(columns);
    const Eigen::MatrixXd left = v(rows, Eigen::all);
    Eigen::MatrixXd products(clusters(), v.cols());
    for (int c = 0; c < clusters(); ++c) {
      const Eigen::VectorXd part = grams_[c](rows, columns) * right;
      products.row(c).noalias() = part.transpose() * left;
    }
    return products;
  }

  // Log marginal likelihood up to a constant: the first `integrated` border unknowns are integrated
  // out, the others are at their optimum. -1e300 where M is not positive definite.
  double LogEvidence(int integrated) const {
    const Eigen::LLT<Eigen::MatrixXd> all(M_);
    if (all.info() != Eigen::Success) return -1e300;
    return LogDeterminants(integrated) - 0.5 * (rss_ - b_.dot(all.solve(b_)));
  }
  // Its part without the cost: weights and determinants.
  double LogDeterminants(int integrated) const {
    const Eigen::LLT<Eigen::MatrixXd> part(M_.topLeftCorner(integrated, integrated));
    if (part.info() != Eigen::Success) return -1e300;
    return log_weights_ - 0.5 * log_det_ - part.matrixLLT().diagonal().array().log().sum();
  }

  // The same system from the given clusters only; the priors count once.
  ReducedSystem Only(const std::vector<bool>& used) const {
    std::vector<Eigen::MatrixXd> grams;
    for (int c = 0; c < clusters(); ++c) {
      if (used[c]) grams.push_back(grams_[c]);
    }
    return {std::move(grams), prior_, log_det_, log_weights_};
  }
  // The same system with the given border unknowns only, in that order; all others are zero.
  ReducedSystem Select(const std::vector<int>& kept) const {
    std::vector<int> with_residual = kept;
    with_residual.push_back(border());
    std::vector<Eigen::MatrixXd> grams;
    grams.reserve(grams_.size());
    for (const Eigen::MatrixXd& gram : grams_) {
      grams.emplace_back(gram(with_residual, with_residual));
    }
    return {std::move(grams), {prior_.precision(kept), prior_.error(kept)}, log_det_, log_weights_};
  }

 private:
  std::vector<Eigen::MatrixXd> grams_;
  Prior prior_;
  Eigen::MatrixXd M_;
  Eigen::VectorXd b_;
  double rss_ = 0.0, log_det_ = 0.0, log_weights_ = 0.0;
};

}  // namespace trueline
