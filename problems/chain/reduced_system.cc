#include "problems/chain/reduced_system.h"

#include <Eigen/Cholesky>
#include <vector>

namespace trueline {

ReducedSystem::ReducedSystem(std::vector<Eigen::MatrixXd> grams, Prior prior, double log_det,
                             double log_weights)
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

Eigen::VectorXd ReducedSystem::Solution() const { return -M_.ldlt().solve(b_); }

Eigen::VectorXd ReducedSystem::Fitted() const {
  Eigen::VectorXd fitted(border() + 1);
  fitted << Solution(), 1.0;
  return fitted;
}

Eigen::MatrixXd ReducedSystem::Covariance() const {
  return M_.ldlt().solve(Eigen::MatrixXd::Identity(border(), border()));
}

Eigen::MatrixXd ReducedSystem::ClusterProducts(const Eigen::VectorXd& e,
                                               const Eigen::MatrixXd& v) const {
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

double ReducedSystem::LogEvidence(int integrated) const {
  const Eigen::LLT<Eigen::MatrixXd> all(M_);
  if (all.info() != Eigen::Success) return -1e300;
  return LogDeterminants(integrated) - 0.5 * (rss_ - b_.dot(all.solve(b_)));
}

double ReducedSystem::LogDeterminants(int integrated) const {
  const Eigen::LLT<Eigen::MatrixXd> part(M_.topLeftCorner(integrated, integrated));
  if (part.info() != Eigen::Success) return -1e300;
  return log_weights_ - 0.5 * log_det_ - part.matrixLLT().diagonal().array().log().sum();
}

ReducedSystem ReducedSystem::Only(const std::vector<bool>& used) const {
  std::vector<Eigen::MatrixXd> grams;
  for (int c = 0; c < clusters(); ++c) {
    if (used[c]) grams.push_back(grams_[c]);
  }
  return {std::move(grams), prior_, log_det_, log_weights_};
}

ReducedSystem ReducedSystem::Select(const std::vector<int>& kept) const {
  std::vector<int> with_residual = kept;
  with_residual.push_back(border());
  std::vector<Eigen::MatrixXd> grams;
  grams.reserve(grams_.size());
  for (const Eigen::MatrixXd& gram : grams_) {
    grams.emplace_back(gram(with_residual, with_residual));
  }
  return {std::move(grams), {prior_.precision(kept), prior_.error(kept)}, log_det_, log_weights_};
}

}  // namespace trueline
