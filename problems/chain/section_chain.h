// A linearised chain in sections: every row depends on one node, on the next node, on unknowns that
// the section's nodes share, and on a border. A section's shared unknowns are linked to those of
// the next section. Rows enter a small dense front, from which nodes and sections are eliminated in
// the order of time, so the cost is linear in the chain's length, and only the factors are kept.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace trueline {

template <int kNode, int kShared>
class SectionChain {
 public:
  // Columns of a row: the next section's shared unknowns, the next node, the node, the section's
  // shared unknowns, the border, the residual.
  static constexpr int kNextSharedAt = 0, kNextAt = kShared, kNodeAt = kNextAt + kNode,
                       kSharedAt = kNodeAt + kNode, kBorderAt = kSharedAt + kShared;
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  // The first `local` of the `border` unknowns belong to one section each: their columns are used
  // again by the next one.
  SectionChain(int border, int local)
      : local_(local),
        width_(kBorderAt + border + 1),
        front_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_)),
        squares_(width_) {}

  int width() const { return width_; }
  // For that many unknowns: a vector that grows copies the factors of an hour's flight.
  void Reserve(std::size_t unknowns) {
    factors_.reserve(unknowns * width_);
    damping_.reserve(unknowns);
  }

  // Starts a new linearisation. A finite `radius` damps as Ceres' Levenberg-Marquardt does: by the
  // Hessian's diagonal over the radius. The least diagonal counts in units that the first damped
  // linearisation since ForgetUnits fixes.
  void ForgetUnits() { units_.clear(); }
  void Begin(double radius) {
    radius_ = radius;
    std::fill(front_.begin(), front_.end(), 0.0);
    std::fill(squares_.begin(), squares_.end(), 0.0);
    blocks_.clear();
    rows_ = unknowns_ = 0;
    log_det_ = decrease_ = 0.0;
  }

  // Adds rows (count x width()) of the current node, or of the link between sections: fastest all
  // of a node at once. `factor`: on their squares.
  void AddRows(const double* rows, int count, double factor = 1.0) {
    AddProducts(factor, rows, count, 0, width_, width_);
  }

  // Each eliminates what no later row depends on, and returns its block: the node; the section with
  // its local border after its last node and its link to the next section; at the end of the chain
  // the last section with the whole border.
  int EndNode() {
    Eliminate(Kind::kOfNode, kNodeAt, kNode, kNextAt);
    Move(kNextAt, kNodeAt, kNode);
    return static_cast<int>(blocks_.size()) - 1;
  }
  int EndSection() {
    Eliminate(Kind::kOfSection, kSharedAt, kShared + local_, 0);
    Clear(kSharedAt, kShared + local_);
    for (int i = 0; i < kNode; ++i) {
      for (int j = 0; j < kShared; ++j) Front(kNodeAt + i, kSharedAt + j) = Front(j, kNodeAt + i);
    }
    Move(kNextSharedAt, kSharedAt, kShared);
    return static_cast<int>(blocks_.size()) - 1;
  }
  int EndChain() {
    Eliminate(Kind::kOfSection, kSharedAt, width_ - 1 - kSharedAt, kNodeAt);
    return static_cast<int>(blocks_.size()) - 1;
  }

  // Log determinant of the Hessian, damping included. Unknowns on which no row depends do not
  // count, nor do directions that the rows leave open.
  double log_det() const { return log_det_; }

  // The Gram matrix of the border and the residual after the elimination so far.
  Eigen::MatrixXd BorderGram() const {
    const Eigen::Map<const Columns> front(front_.data(), width_, width_);
    const int size = width_ - kBorderAt;
    return Eigen::MatrixXd(front.bottomRightCorner(size, size)).selfadjointView<Eigen::Upper>();
  }

  // Finds the step that minimises the damped cost. Returns the decrease of half the sum of squares
  // that the rows predict for it. A block's unknowns are in the order of the columns.
  double Solve() {
    step_.resize(unknowns_);
    std::vector<double>& v = values_;
    v.assign(width_, 0.0);
    v.back() = 1.0;
    double damped = 0.0;
    for (std::size_t b = blocks_.size(); b-- > 0;) {
      const Block& block = blocks_[b];
      if (block.kind == Kind::kOfNode) {
        std::copy_n(v.begin() + kNodeAt, kNode, v.begin() + kNextAt);
      } else {
        std::copy_n(v.begin() + kSharedAt, kShared, v.begin() + kNextSharedAt);
      }
      for (int k = block.count; k-- > 0;) {
        const int pivot = block.first + k;
        const double* y = RowOf(block, k);
        double sum = 0.0;
        for (int j = block.begin; j < block.first; ++j) sum += y[j] * v[j];
        for (int j = pivot + 1; j < width_; ++j) sum += y[j] * v[j];
        v[pivot] = y[pivot] > 0.0 ? -sum / y[pivot] : 0.0;
        step_[block.unknown + k] = v[pivot];
        damped += damping_[block.unknown + k] * v[pivot] * v[pivot];
      }
    }
    return 0.5 * (decrease_ + damped);
  }
  const double* step(int block) const { return step_.data() + blocks_[block].unknown; }

  // Covariance of `count` linear functions of the unknowns, without damping: G' H^-1 G. Before each
  // block add(block, &G) adds the functions' derivatives by that block's unknowns
  // (and by those of later blocks that have columns already) to the rows of G, one for each column.
  // Directions that the rows leave open count as certain.
  using AddSlopes = std::function<void(int block, Columns* G)>;
  Eigen::MatrixXd Covariance(int count, const AddSlopes& add) const {
    Eigen::MatrixXd cov = Eigen::MatrixXd::Zero(count, count);
    Columns G = Columns::Zero(width_, count);
    for (int b = 0; b < static_cast<int>(blocks_.size()); ++b) {
      const Block& block = blocks_[b];
      add(b, &G);
      for (int k = 0; k < block.count; ++k) {
        const int pivot = block.first + k;
        const double* y = RowOf(block, k);
        if (!(y[pivot] > 0.0)) continue;
        G.row(pivot) /= y[pivot];
        cov.noalias() += G.row(pivot).transpose() * G.row(pivot);
        for (int j = block.begin; j < block.first; ++j) G.row(j) -= y[j] * G.row(pivot);
        for (int j = pivot + 1; j + 1 < width_; ++j) G.row(j) -= y[j] * G.row(pivot);
      }
      G.middleRows(block.first, block.count).setZero();
      const bool node = block.kind == Kind::kOfNode;
      auto next = G.middleRows(node ? kNextAt : kNextSharedAt, node ? kNode : kShared);
      G.middleRows(node ? kNodeAt : kSharedAt, next.rows()) = next;
      next.setZero();
    }
    return cov;
  }

  // Visits all blocks from the last one on: visit(block, F) with the joint covariance F of the
  // node, the section's shared unknowns and the border. After a section's own block the node is the
  // first of the next section.
  using VisitCovariance = std::function<void(int block, const Eigen::MatrixXd& F)>;
  void VisitCovariances(const VisitCovariance& visit) const {
    const int border = width_ - 1 - kBorderAt, rest = kShared + border, global = border - local_;
    Eigen::MatrixXd F = Eigen::MatrixXd::Zero(kNode + rest, kNode + rest);
    Eigen::MatrixXd K, U, inverse, cross;
    for (int b = static_cast<int>(blocks_.size()); b-- > 0;) {
      const Block& block = blocks_[b];
      const Eigen::Map<const Columns> Y(RowOf(block, 0), block.count, width_);
      // The others, in the order of F: the next node or the section's end; what is shared next.
      const bool node = block.kind == Kind::kOfNode, last = b + 1 == int(blocks_.size());
      K.setZero(block.count, kNode + rest);
      if (node) {
        K << Y.middleCols(kNextAt, kNode), Y.middleCols(kSharedAt, rest);
      } else if (!last) {
        K.leftCols(kNode) = Y.middleCols(kNodeAt, kNode);
        K.middleCols(kNode, kShared) = Y.middleCols(kNextSharedAt, kShared);
        K.rightCols(global) = Y.middleCols(width_ - 1 - global, global);
      }
      inverse.setIdentity(block.count, block.count);
      U = Y.middleCols(block.first, block.count);
      for (int k = 0; k < block.count; ++k) {
        if (U(k, k) > 0.0) continue;
        U(k, k) = 1.0;
        inverse(k, k) = 0.0;
      }
      U.triangularView<Eigen::Upper>().solveInPlace(K);
      U.triangularView<Eigen::Upper>().solveInPlace(inverse);
      cross.noalias() = K * F;  // less the sign
      const int at = node ? 0 : kNode;
      auto own = F.block(at, at, block.count, block.count);
      own.noalias() = inverse * inverse.transpose();
      own.noalias() += cross * K.transpose();
      const int before = at, after = kNode + rest - at - block.count;
      F.block(at, 0, block.count, before) = -cross.leftCols(before);
      F.block(at, at + block.count, block.count, after) = -cross.rightCols(after);
      F.block(0, at, before, block.count) = -cross.leftCols(before).transpose();
      F.block(at + block.count, at, after, block.count) = -cross.rightCols(after).transpose();
      visit(b, F);
    }
  }

 private:
  enum class Kind { kOfNode, kOfSection };

  // Eliminated unknowns: `count` columns from `first` on. Their rows of the factor reach from
  // column `begin` on; row k holds L^-1 times the front, its pivot at first + k.
  struct Block {
    Kind kind;
    int first, count, begin;
    std::size_t row, unknown;  // of the first
  };

  double& Front(int i, int j) { return front_[static_cast<std::size_t>(i) * width_ + j]; }
  const double* RowOf(const Block& block, int k) const {
    return factors_.data() + (block.row + k) * width_;
  }

  // Adds `factor` times the products of the rows to the front's upper triangle, except for its rows
  // [skip, end); factor > 0: to the columns' squares, too.
  void AddProducts(double factor, const double* rows, int count, int begin, int skip, int end) {
    int i = 0;
    for (; i + 4 <= count; i += 4) AddFew<4>(factor, rows + Offset(i), begin, skip, end);
    if (count - i == 3) AddFew<3>(factor, rows + Offset(i), begin, skip, end);
    if (count - i == 2) AddFew<2>(factor, rows + Offset(i), begin, skip, end);
    if (count - i == 1) AddFew<1>(factor, rows + Offset(i), begin, skip, end);
  }
  std::ptrdiff_t Offset(int rows) const { return static_cast<std::ptrdiff_t>(rows) * width_; }

  template <int kRows>
  void AddFew(double factor, const double* rows, int begin, int skip, int end) {
    const int width = width_;
    for (int i = begin; i < width; ++i) {
      if (i == skip) i = end;
      if (i >= width) return;
      double a[kRows], squares = 0.0;
      for (int r = 0; r < kRows; ++r) {
        const double value = rows[r * width + i];
        a[r] = factor * value;
        squares += a[r] * value;
      }
      if (squares == 0.0) continue;
      if (factor > 0.0) squares_[i] += squares;
      AddScaled<kRows>(a, rows + i, width, width - i, &Front(i, i));
    }
  }

  // to += a[0] row 0 + a[1] row 1 + ...
  template <int kRows>
  static void AddScaled(const double* a, const double* __restrict rows, int stride, int count,
                        double* __restrict to) {
    for (int j = 0; j < count; ++j) {
      double sum = to[j];
      for (int r = 0; r < kRows; ++r) sum += a[r] * rows[r * stride + j];
      to[j] = sum;
    }
  }

  void Eliminate(Kind kind, int first, int count, int begin) {
    constexpr double kOpen = 1e-14;  // of a column's squares: a smaller pivot is rounding error
    const Block block{kind, first, count, begin, rows_, unknowns_};
    blocks_.push_back(block);
    rows_ += count;
    unknowns_ += count;
    if (factors_.size() < rows_ * width_) factors_.resize(rows_ * width_);
    if (damping_.size() < unknowns_) damping_.resize(unknowns_);
    double* const Y = factors_.data() + block.row * width_;
    for (int k = 0; k < count; ++k) {
      const int pivot = first + k;
      double* const y = Y + Offset(k);
      for (int i = begin; i < first; ++i) y[i] = Front(i, pivot);
      std::fill(y + first, y + pivot, 0.0);
      std::copy(&Front(pivot, 0) + pivot, &Front(pivot, 0) + width_, y + pivot);
      damping_[block.unknown + k] = Damping(block.unknown + k, squares_[pivot]);
      y[pivot] += damping_[block.unknown + k];
      for (int m = 0; m < k; ++m) {
        const double* const z = Y + Offset(m);
        const double a = -z[pivot];
        if (a == 0.0) continue;
        AddScaled<1>(&a, z + begin, 0, first - begin, y + begin);
        AddScaled<1>(&a, z + pivot, 0, width_ - pivot, y + pivot);
      }
      if (!(y[pivot] > kOpen * squares_[pivot])) {
        std::fill(y, y + width_, 0.0);
        continue;
      }
      log_det_ += std::log(y[pivot]);
      const double scale = 1.0 / std::sqrt(y[pivot]);
      for (int j = begin; j < first; ++j) y[j] *= scale;
      for (int j = pivot; j < width_; ++j) y[j] *= scale;
      decrease_ += y[width_ - 1] * y[width_ - 1];
    }
    AddProducts(-1.0, Y, count, begin, first, first + count);
  }

  double Damping(std::size_t unknown, double squares) {
    constexpr double kLeast = 1e-6;  // of the diagonal in the first linearisation's units
    if (!std::isfinite(radius_) || squares == 0.0) return 0.0;
    while (units_.size() <= unknown) units_.push_back(0.0);
    if (units_[unknown] == 0.0) units_[unknown] = std::pow(1.0 + std::sqrt(squares), 2);
    return std::max(squares, kLeast * units_[unknown]) / radius_;
  }

  // Clears the rows and columns of the front.
  void Clear(int first, int count) {
    for (int i = 0; i < first; ++i) std::fill_n(&Front(i, first), count, 0.0);
    for (int i = first; i < first + count; ++i) std::fill_n(&Front(i, 0), width_, 0.0);
    std::fill_n(squares_.begin() + first, count, 0.0);
  }

  // Moves rows to the place of eliminated ones. Their columns between both places are not kept.
  void Move(int from, int to, int count) {
    for (int i = 0; i < count; ++i) {
      for (int j = i; j < count; ++j) Front(to + i, to + j) = Front(from + i, from + j);
      for (int j = to + count; j < width_; ++j) Front(to + i, j) = Front(from + i, j);
      squares_[to + i] = squares_[from + i];
    }
    Clear(from, count);
  }

  int local_, width_;
  double radius_ = std::numeric_limits<double>::infinity();
  std::vector<double> front_;    // upper triangle of the normal matrix, residual last
  std::vector<double> squares_;  // of its columns, before any elimination
  std::vector<Block> blocks_;
  std::vector<double> factors_;         // width_ numbers a row
  std::vector<double> damping_, step_;  // by unknown, in the order of elimination
  std::vector<double> units_;           // squared, of the damping, by unknown
  std::vector<double> values_;
  std::size_t rows_ = 0, unknowns_ = 0;  // in use
  double log_det_ = 0.0, decrease_ = 0.0;
};

}  // namespace trueline
