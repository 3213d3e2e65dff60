#include "problems/rotor_batch/rotor_normal.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "problems/rotor_batch/rotor_costs.h"

namespace trueline {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Columns of the free constants (in prior sigmas), of the effects, and the residual, side by side.
Matrix BorderOf(const Matrix& d_constants, const std::vector<int>& free,
                const RotorConstants& scale, const Matrix& columns, const Vector& error) {
  const auto constants = static_cast<Eigen::Index>(free.size());
  Matrix border(error.size(), constants + columns.cols() + 1);
  for (Eigen::Index i = 0; i < constants; ++i) {
    border.col(i) = d_constants.col(free[i]) * scale[free[i]];
  }
  border.middleCols(constants, columns.cols()) = columns;
  border.rightCols<1>() = error;
  return border;
}

// d(error of a pose) / d(size of each column), in sigmas.
Matrix PoseColumns(const RotorColumns& columns, const RotorBatchOptions& options, double t,
                   const RotorState& x, Eigen::Index rows) {
  if (columns.read == nullptr) return Matrix::Zero(rows, columns.count);
  Matrix read = Matrix::Zero(6, columns.count);
  columns.read(t, x, &read);
  read.topRows<3>() /= options.noise.position;
  read.bottomRows<3>() /= options.noise.attitude;
  return read.topRows(rows);
}

}  // namespace

// A node with its pose and the segment to the next node, whitened; then the factors of elimination.
struct RotorNormal::Link {
  int cluster;
  Matrix pose_d, pose_border;
  Matrix d_start, d_next, border;  // no rows after the last node
  Eigen::LLT<Matrix> own;          // of the node, what came before eliminated
  Matrix to_next, to_border;       // its coupling in the information
  Matrix response;                 // of the node to border values, kNodeErrors x (border + 1)
};

RotorNormal::RotorNormal(const RotorAeroModel& model, const RotorData& data,
                         const RotorBatchOptions& options, const RotorBatchResult& batch,
                         const RotorColumns& columns, double cluster)
    : free_(options.prior.Free()), scale_(options.prior.sigma) {
  const std::size_t nodes = batch.nodes.size();
  const double start = data.poses.front().t, length = data.poses.back().t - start;
  const int count = std::max(1, static_cast<int>(length / cluster));
  std::vector<Link> links(nodes);
  std::vector<RotorSegment> segments = CutSegments(data);
  for (std::size_t i = 0; i < nodes; ++i) {
    Link& link = links[i];
    link.cluster =
        std::min(count - 1, static_cast<int>((data.poses[i].t - start) / length * count));
    const PoseResidual pose =
        EvaluatePose(data.poses[i], data.attitude, options.noise, batch.nodes[i], batch.mean);
    const double root = std::sqrt(options.PoseWeight(pose.error.norm()));
    link.pose_d = root * pose.d_node;
    const Matrix read = PoseColumns(columns, options, data.poses[i].t,
                                    Joined(batch.nodes[i], batch.mean), pose.error.size());
    link.pose_border = root * BorderOf(pose.d_constants, free_, scale_, read, pose.error);
    if (i + 1 == nodes) break;
    SegmentModel segment(model, data, options.noise, std::move(segments[i]));
    segment.SetWeight(batch.nodes[i], batch.mean);
    SegmentResidual step = segment.Evaluate(batch.nodes[i], batch.nodes[i + 1], batch.mean, true);
    segment.Whiten(&step);
    Matrix pushed(step.error.size(), 0);
    if (columns.count > 0) {
      pushed = segment.Respond(batch.nodes[i], batch.nodes[i + 1], batch.mean, columns.count,
                               columns.push);
      segment.Whiten(&pushed);
    }
    link.d_start = std::move(step.d_start);
    link.d_next = std::move(step.d_next);
    link.border = BorderOf(step.d_constants, free_, scale_, pushed, step.error);
  }
  prior_error_.resize(static_cast<Eigen::Index>(free_.size()));
  for (Eigen::Index i = 0; i < prior_error_.size(); ++i) {
    prior_error_[i] = (batch.mean[free_[i]] - options.prior.mean[free_[i]]) / scale_[free_[i]];
  }
  Eliminate(&links);
  const Eigen::Index size = links.front().pose_border.cols();
  grams_.assign(count, Matrix::Zero(size, size));
  for (std::size_t i = 0; i < nodes; ++i) {
    const Link& link = links[i];
    Matrix rows = link.pose_border + link.pose_d * link.response;
    grams_[link.cluster].noalias() += rows.transpose() * rows;
    if (i + 1 == nodes) break;
    rows = link.border + link.d_start * link.response + link.d_next * links[i + 1].response;
    grams_[link.cluster].noalias() += rows.transpose() * rows;
  }
  Sum();
}

// Eliminates nodes forward along the chain by block Cholesky, then back-substitutes each node as a
// linear function of the border values.
void RotorNormal::Eliminate(std::vector<Link>* links) const {
  Matrix left = Matrix::Zero(kNodeErrors, kNodeErrors);
  Matrix left_border = Matrix::Zero(kNodeErrors, links->front().pose_border.cols());
  for (std::size_t i = 0; i < links->size(); ++i) {
    Link& link = (*links)[i];
    left.noalias() += link.pose_d.transpose() * link.pose_d;
    left_border.noalias() += link.pose_d.transpose() * link.pose_border;
    const bool last = i + 1 == links->size();
    if (!last) {
      left.noalias() += link.d_start.transpose() * link.d_start;
      left_border.noalias() += link.d_start.transpose() * link.border;
      link.to_next = link.d_start.transpose() * link.d_next;
    }
    link.own.compute(left);
    CHECK(link.own.info() == Eigen::Success);
    link.to_border = left_border;
    if (last) break;
    const Matrix next_by_own = link.own.solve(link.to_next).transpose();
    left = link.d_next.transpose() * link.d_next - next_by_own * link.to_next;
    left_border = link.d_next.transpose() * link.border - next_by_own * link.to_border;
  }
  for (std::size_t i = links->size(); i-- > 0;) {
    Link& link = (*links)[i];
    Matrix right = link.to_border;
    if (i + 1 < links->size()) right.noalias() += link.to_next * (*links)[i + 1].response;
    link.response = -link.own.solve(right);
  }
}

void RotorNormal::Sum() {
  const Eigen::Index border = grams_.front().rows() - 1;
  Matrix sum = Matrix::Zero(border + 1, border + 1);
  for (const Matrix& gram : grams_) sum += gram;
  M_ = sum.topLeftCorner(border, border);
  b_ = sum.col(border).head(border);
  const Eigen::Index constants = prior_error_.size();
  M_.diagonal().head(constants).array() += 1.0;
  b_.head(constants) += prior_error_;
}

Matrix RotorNormal::ClusterProducts(const Vector& e, const Matrix& v) const {
  Matrix products(grams_.size(), v.cols());
  for (std::size_t c = 0; c < grams_.size(); ++c) {
    products.row(static_cast<Eigen::Index>(c)) = e.transpose() * grams_[c] * v;
  }
  return products;
}

RotorNormal RotorNormal::Only(const std::vector<bool>& used) const {
  RotorNormal part = *this;
  part.grams_.clear();
  for (std::size_t c = 0; c < grams_.size(); ++c) {
    if (used[c]) part.grams_.push_back(grams_[c]);
  }
  part.Sum();
  return part;
}

RotorNormal RotorNormal::Select(const std::vector<int>& columns) const {
  std::vector<int> kept(constants());
  std::iota(kept.begin(), kept.end(), 0);
  for (const int column : columns) kept.push_back(constants() + column);
  kept.push_back(border());
  RotorNormal part = *this;
  for (Matrix& gram : part.grams_) gram = Matrix(gram(kept, kept));
  part.Sum();
  return part;
}

Matrix RotorNormal::NoiseCovariance() const {
  const Eigen::Index n = constants();
  return InUnits(M_.topLeftCorner(n, n).llt().solve(Matrix::Identity(n, n)));
}

Matrix RotorNormal::ClusterCovariance() const {
  const Eigen::Index n = constants();
  const Matrix I = Matrix::Identity(n, n);
  const Matrix bread = M_.topLeftCorner(n, n).llt().solve(I);
  Vector residual = Vector::Unit(border() + 1, border());
  Matrix v = Matrix::Zero(border() + 1, n);
  v.topRows(n) = I;
  const Matrix scores = ClusterProducts(residual, v);
  const double count = clusters();
  const Matrix scatter = scores.transpose() * scores * (count / std::max(1.0, count - 1.0)) + I;
  return InUnits(bread * scatter * bread);
}

Matrix RotorNormal::ColumnCovariance() const {
  const Eigen::Index n = constants();
  const Matrix moved = M_.topLeftCorner(n, n).llt().solve(M_.topRightCorner(n, border() - n));
  return InUnits(moved * moved.transpose());
}

Matrix RotorNormal::InUnits(const Matrix& scaled) const {
  Matrix cov = Matrix::Zero(RotorAeroModel::kConstants, RotorAeroModel::kConstants);
  for (Eigen::Index i = 0; i < scaled.rows(); ++i) {
    for (Eigen::Index j = 0; j < scaled.cols(); ++j) {
      cov(free_[i], free_[j]) = scaled(i, j) * scale_[free_[i]] * scale_[free_[j]];
    }
  }
  return cov;
}

RotorConstants WideningFactors(const RotorAeroModel& model, const RotorData& data,
                               const RotorBatchOptions& options, const RotorBatchResult& batch) {
  constexpr double kShortest = 0.5;  // s, least length of a cluster
  constexpr double kClusters = 20.0;
  const double length = data.poses.back().t - data.poses.front().t;
  const double cluster = std::max(kShortest, length / kClusters);
  const Matrix cov = RotorNormal(model, data, options, batch, {}, cluster).ClusterCovariance();
  RotorConstants factors = RotorConstants::Ones();
  for (const int i : options.prior.Free()) {
    factors[i] = std::max(1.0, std::sqrt(cov(i, i) / batch.cov(i, i)));
  }
  return factors;
}

}  // namespace trueline
