#include "problems/diagnosis/chain_system.h"

#include <Eigen/Cholesky>

namespace trueline {
namespace {

using Matrix = Eigen::MatrixXd;

// Stacks all rows of a segment, kind by kind.
RowStack Join(const std::vector<RowStack>& parts, int width) {
  int count = 0;
  for (const RowStack& part : parts) count += static_cast<int>(part.row.size());
  RowStack all(count, width);
  int at = 0;
  for (const RowStack& part : parts) {
    const int size = static_cast<int>(part.row.size());
    all.values.middleRows(at, size) = part.values;
    std::copy(part.row.begin(), part.row.end(), all.row.begin() + at);
    std::copy(part.cluster.begin(), part.cluster.end(), all.cluster.begin() + at);
    all.log_weights += part.log_weights;
    at += size;
  }
  return all;
}

}  // namespace

Reduced Reduce(const LinearFlight& linear, const ChainElimination& elimination,
               double log_weights) {
  const Matrix& C = elimination.border();
  const int z = linear.width() - 1, columns = linear.columns.count();
  const Columns& prior = linear.columns;
  Reduced reduced;
  reduced.M = C.topLeftCorner(z, z);
  reduced.b = C.col(z).head(z);
  reduced.rss =
      C(z, z) + linear.x.theta.squaredNorm() + prior.precision.dot(prior.value.cwiseAbs2());
  reduced.M.diagonal().head<kThetaSize>().array() += 1.0;  // theta's prior, in its own sigmas
  reduced.b.head<kThetaSize>() += linear.x.theta;
  reduced.M.diagonal().tail(columns) += prior.precision;
  reduced.b.tail(columns) += prior.precision.cwiseProduct(prior.value);
  reduced.log_det = elimination.log_det();
  reduced.log_weights = log_weights;
  return reduced;
}

double LogEvidence(const Reduced& reduced, int nuisances) {
  const Eigen::LLT<Matrix> all(reduced.M);
  const Eigen::LLT<Matrix> nuisance(reduced.M.topLeftCorner(nuisances, nuisances));
  if (all.info() != Eigen::Success || nuisance.info() != Eigen::Success) return -1e300;
  const double rss = reduced.rss - reduced.b.dot(all.solve(reduced.b));
  const Matrix L = nuisance.matrixL();
  return reduced.log_weights - 0.5 * rss - 0.5 * reduced.log_det - L.diagonal().array().log().sum();
}

ChainSystem::ChainSystem(const LinearFlight& linear, const NoiseStrengths& noise)
    : flight_(linear.flight) {
  const int segments = static_cast<int>(flight_.plan().segments.size());
  ChainElimination elimination(linear.width());
  eliminated_.resize(segments);
  double log_weights = 0.0;
  for (int s = 0; s < segments; ++s) {
    stacks_.push_back(
        Join({FixStack(linear, s, noise.fix_scale), ForceStack(linear, s, noise.force_sigma),
              LinkStack(linear, s, noise), StartStack(linear, s, noise)},
             linear.width()));
    const Matrix gram = stacks_[s].values.transpose() * stacks_[s].values;
    elimination.Add(gram, &eliminated_[s]);
    log_weights += stacks_[s].log_weights;
  }
  reduced_ = Reduce(linear, elimination, log_weights);
}

std::vector<Matrix> ChainSystem::NodesFor(const Matrix& border_values) const {
  std::vector<Matrix> nodes(eliminated_.size());
  Matrix next = Matrix::Zero(kNodeSize, border_values.cols());
  for (int s = static_cast<int>(nodes.size()) - 1; s >= 0; --s) {
    const EliminatedSegment& e = eliminated_[s];
    const Matrix right = -(e.border * border_values + e.next * next);
    nodes[s] = e.L.transpose().triangularView<Eigen::Upper>().solve(right);
    next = nodes[s];
  }
  return nodes;
}

Matrix ChainSystem::RowsFor(int s, const Matrix& border_values,
                            const std::vector<Matrix>& nodes) const {
  const auto& values = stacks_[s].values;
  Matrix rows = values.rightCols(border_values.rows()) * border_values +
                values.leftCols<kNodeSize>() * nodes[s];
  if (flight_.plan().segments[s].linked) {
    rows += values.middleCols<kNodeSize>(kNodeSize) * nodes[s + 1];
  }
  return rows;
}

Matrix ChainSystem::ClusterProducts(const Eigen::VectorXd& e, const Matrix& v) const {
  Matrix all(border() + 1, v.cols() + 1);
  all << v, e;
  const std::vector<Matrix> nodes = NodesFor(all);
  Matrix products = Matrix::Zero(flight_.plan().clusters, v.cols());
  for (int s = 0; s < static_cast<int>(stacks_.size()); ++s) {
    const Matrix rows = RowsFor(s, all, nodes);
    for (int i = 0; i < rows.rows(); ++i) {
      products.row(stacks_[s].cluster[i]) += rows(i, v.cols()) * rows.row(i).head(v.cols());
    }
  }
  return products;
}

Eigen::VectorXd ChainSystem::Whitened(const Eigen::VectorXd& e) const {
  const std::vector<Matrix> nodes = NodesFor(e);
  Eigen::VectorXd whitened = Eigen::VectorXd::Zero(flight_.measurement_rows());
  for (int s = 0; s < static_cast<int>(stacks_.size()); ++s) {
    const Matrix rows = RowsFor(s, e, nodes);
    for (int i = 0; i < rows.rows(); ++i) {
      if (stacks_[s].row[i] >= 0) whitened[stacks_[s].row[i]] = rows(i, 0);
    }
  }
  return whitened;
}

}  // namespace trueline
