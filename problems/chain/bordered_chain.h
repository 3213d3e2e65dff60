// A linearised chain with a border: every whitened row depends on one node, on the next node, and
// on the border (unknowns that all nodes share, effects' sizes, and in its last column the
// residual). The normal equations are block-tridiagonal in the nodes; block Cholesky eliminates
// them one by one onto the border, so the cost is linear in the chain's length.
#pragma once

#include <glog/logging.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "problems/chain/reduced_system.h"
#include "problems/common/parallel.h"

namespace trueline {

// The whitened rows that belong to one node.
template <int kNode>
struct NodeRows {
  using Values = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  Values values;             // rows x (kNode + kNode + border)
  std::vector<int> cluster;  // by row
  std::vector<int> id;       // by row: the owner's name for a measurement; -1 for links and priors
  double log_weights = 0.0;  // sum of the logarithms of what whitens

  NodeRows(int count, int border) : cluster(count, 0), id(count, -1) {
    values.setZero(count, 2 * kNode + border);
  }
  int count() const { return static_cast<int>(values.rows()); }
  auto node() { return values.template leftCols<kNode>(); }
  auto next() { return values.template middleCols<kNode>(kNode); }
  auto border() { return values.rightCols(values.cols() - 2L * kNode); }
  // The rows of the Gram matrix values' values that belong to the two nodes.
  Eigen::MatrixXd NodesGram() const {
    return values.template leftCols<2 * kNode>().transpose() * values;
  }

  // Appends the rows of `more`.
  void Add(const NodeRows& more) {
    Values all(count() + more.count(), values.cols());
    all << values, more.values;
    values = std::move(all);
    cluster.insert(cluster.end(), more.cluster.begin(), more.cluster.end());
    id.insert(id.end(), more.id.begin(), more.id.end());
    log_weights += more.log_weights;
  }
};

// An eliminated node: its unknowns are -L'^-1 (border z + next x_next).
template <int kNode>
struct EliminatedNode {
  Eigen::Matrix<double, kNode, kNode> L;
  Eigen::Matrix<double, kNode, kNode> next;
  Eigen::MatrixXd border;  // kNode x border
};

// Forward elimination over all nodes in turn.
template <int kNode>
class ChainElimination {
 public:
  // `border`: columns of the border, residual included.
  explicit ChainElimination(int border)
      : width_(border), B_(Eigen::MatrixXd::Zero(kNode, border)) {}

  // gram: of all rows of a node values' values, of which the rows that belong to the two nodes
  // suffice (NodesGram). The factors are stored in `out`.
  void Add(const Eigen::MatrixXd& gram, EliminatedNode<kNode>* out) {
    EliminatedNode<kNode>& e = *out;
    D_ += gram.topLeftCorner<kNode, kNode>();
    B_ += gram.topRightCorner(kNode, width_);
    const Eigen::LLT<Block> llt(D_);
    regular_ = regular_ && llt.info() == Eigen::Success;
    e.L = llt.matrixL();
    const auto L = e.L.template triangularView<Eigen::Lower>();
    e.next = gram.block<kNode, kNode>(0, kNode);
    L.solveInPlace(e.next);
    e.border = B_;
    L.solveInPlace(e.border);
    log_det_ += 2.0 * e.L.diagonal().array().log().sum();
    D_ = gram.block<kNode, kNode>(kNode, kNode);
    D_.noalias() -= e.next.transpose() * e.next;
    B_ = gram.block(kNode, Eigen::Index{2} * kNode, kNode, width_);
    B_.noalias() -= e.next.transpose() * e.border;
  }

  double log_det() const { return log_det_; }
  bool regular() const { return regular_; }  // false: a node is not determined by its rows

 private:
  using Block = Eigen::Matrix<double, kNode, kNode>;

  int width_;
  Block D_ = Block::Zero();
  Eigen::MatrixXd B_;
  double log_det_ = 0.0;
  bool regular_ = true;
};

template <int kNode>
class BorderedChain {
 public:
  using Rows = NodeRows<kNode>;

  // Rows by node; all have the same border. A row of the last node does not depend on a next one.
  explicit BorderedChain(std::vector<Rows> nodes)
      : nodes_(std::move(nodes)),
        width_(static_cast<int>(nodes_.front().values.cols()) - 2 * kNode),
        elimination_(width_) {
    eliminated_.resize(nodes_.size());
    const int count = static_cast<int>(nodes_.size());
    std::vector<Eigen::MatrixXd> grams(std::min(count, kAtOnce));
    for (int first = 0; first < count; first += kAtOnce) {
      const int some = std::min(kAtOnce, count - first);
      ParallelRuns(some, InARow(), [&](int i) { grams[i] = nodes_[first + i].NodesGram(); });
      for (int i = 0; i < some; ++i) {
        elimination_.Add(grams[i], &eliminated_[first + i]);
        log_weights_ += nodes_[first + i].log_weights;
      }
    }
  }

  std::size_t size() const { return nodes_.size(); }
  int border() const { return width_ - 1; }  // the residual not counted
  bool regular() const { return elimination_.regular(); }
  double log_weights() const { return log_weights_; }  // of all rows (NodeRows)

  // The nodes' unknowns that minimise the cost at the given border values (border() + 1 rows; the
  // last one multiplies the residual): a matrix for each node, a column for each of `values`.
  std::vector<Eigen::MatrixXd> NodesAt(const Eigen::MatrixXd& values) const {
    return Backwards([&](const EliminatedNode<kNode>& e) { return e.border * values; });
  }

  // Calls visit(node, its rows, their values) for every node at these border values, the nodes'
  // unknowns at their best. The values have a column for each of `values`.
  template <class Visit>
  void VisitRowsAt(const Eigen::MatrixXd& values, Visit&& visit) const {
    const std::vector<Eigen::MatrixXd> unknowns = NodesAt(values);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const auto& rows = nodes_[i].values;
      Eigen::MatrixXd at = rows.rightCols(width_) * values;
      at.noalias() += rows.template leftCols<kNode>() * unknowns[i];
      if (i + 1 < nodes_.size()) {
        at.noalias() += rows.template middleCols<kNode>(kNode) * unknowns[i + 1];
      }
      visit(i, nodes_[i], at);
    }
  }

  // The slope of half the sum of squares along a step: the nodes' unknowns (NodesAt) at these
  // border values.
  double SlopeTo(const std::vector<Eigen::MatrixXd>& nodes, const Eigen::VectorXd& values) const {
    double slope = 0.0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto& rows = nodes_[i].values;
      const Eigen::VectorXd gradient = rows.transpose() * rows.rightCols(1);
      slope += gradient.head<kNode>().dot(nodes[i].col(0));
      if (i + 1 < nodes.size()) {
        slope += gradient.segment<kNode>(kNode).dot(nodes[i + 1].col(0));
      }
      slope += gradient.segment(2 * kNode, border()).dot(values.head(border()));
    }
    return slope;
  }

  // The chain on its border as one cluster, or by the rows' clusters.
  ReducedSystem Reduced(ReducedSystem::Prior prior) const {
    const int runs = (static_cast<int>(nodes_.size()) + kAtOnce - 1) / kAtOnce;
    std::vector<Eigen::MatrixXd> grams(runs);
    ParallelRuns(runs, 1, [&](int run) { grams[run] = BorderGram(run * kAtOnce); });
    return {{std::accumulate(grams.begin() + 1, grams.end(), grams.front())},
            std::move(prior),
            elimination_.log_det(),
            log_weights_};
  }
  ReducedSystem Reduced(ReducedSystem::Prior prior, int clusters) const {
    // The nodes' unknowns by the border.
    const std::vector<Eigen::MatrixXd> unknowns =
        Backwards([](const EliminatedNode<kNode>& e) { return e.border; });
    const std::vector<std::vector<Piece>> pieces = PiecesOf(clusters);
    std::vector<Eigen::MatrixXd> grams(clusters);
    ParallelRuns(clusters, 1, [&](int c) {
      Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(width_, width_), at;
      for (const Piece& piece : pieces[c]) {
        const auto rows = nodes_[piece.node].values.middleRows(piece.first, piece.count);
        at = rows.rightCols(width_);
        at.noalias() += rows.template leftCols<kNode>() * unknowns[piece.node];
        if (piece.node + 1 < nodes_.size()) {
          at.noalias() += rows.template middleCols<kNode>(kNode) * unknowns[piece.node + 1];
        }
        gram.template selfadjointView<Eigen::Lower>().rankUpdate(at.transpose());
      }
      grams[c] = gram.template selfadjointView<Eigen::Lower>();
    });
    return {std::move(grams), std::move(prior), elimination_.log_det(), log_weights_};
  }

 private:
  static constexpr int kAtOnce = 64;  // nodes

  // The Gram matrix of the border after the elimination of the kAtOnce nodes from `first`.
  Eigen::MatrixXd BorderGram(int first) const {
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(width_, width_);
    auto lower = gram.template selfadjointView<Eigen::Lower>();
    const int end = std::min(first + kAtOnce, static_cast<int>(nodes_.size()));
    for (int i = first; i < end; ++i) {
      lower.rankUpdate(nodes_[i].values.rightCols(width_).transpose());
      lower.rankUpdate(eliminated_[i].border.transpose(), -1.0);
    }
    return lower;
  }

  // Rows of one node that belong to one cluster.
  struct Piece {
    std::size_t node;
    int first, count;
  };
  std::vector<std::vector<Piece>> PiecesOf(int clusters) const {
    std::vector<std::vector<Piece>> pieces(clusters);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const std::vector<int>& cluster = nodes_[i].cluster;
      const int count = nodes_[i].count();
      for (int first = 0, end = 0; first < count; first = end) {
        while (end < count && cluster[end] == cluster[first]) ++end;
        pieces[cluster[first]].push_back({i, first, end - first});
      }
    }
    return pieces;
  }

  // Back substitution from the last node: of_border(e) is what e.border contributes.
  template <class OfBorder>
  std::vector<Eigen::MatrixXd> Backwards(const OfBorder& of_border) const {
    std::vector<Eigen::MatrixXd> nodes(eliminated_.size());
    for (std::size_t i = nodes.size(); i-- > 0;) {
      const EliminatedNode<kNode>& e = eliminated_[i];
      Eigen::MatrixXd right = -of_border(e);
      if (i + 1 < nodes.size()) right.noalias() -= e.next * nodes[i + 1];
      e.L.transpose().template triangularView<Eigen::Upper>().solveInPlace(right);
      nodes[i] = std::move(right);
    }
    return nodes;
  }

  // Nodes of one thread: enough to be worth a thread.
  int InARow() const {
    constexpr double kWorth = 2e6;  // products of two numbers
    const auto& values = nodes_.front().values;
    const double products = static_cast<double>(values.size()) * static_cast<double>(values.cols());
    return 1 + static_cast<int>(std::min(kWorth, kWorth / std::max(1.0, 0.5 * products)));
  }

  std::vector<Rows> nodes_;
  std::vector<EliminatedNode<kNode>> eliminated_;
  int width_;
  ChainElimination<kNode> elimination_;
  double log_weights_ = 0.0;
};

}  // namespace trueline
