#include "problems/observability/rank.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <map>
#include <numeric>

#include "problems/common/error.h"

namespace trueline {
namespace {

// The finest split: coordinates with non-zero entries in the same basis vector belong together.
std::vector<std::vector<int>> ConnectedStates(const std::vector<std::vector<int>>& supports,
                                              int count) {
  std::vector<int> parent(count);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<bool> used(count, false);
  for (const auto& support : supports) {
    for (const int i : support) used[i] = true, parent[root(i)] = root(support.front());
  }
  std::map<int, std::vector<int>> by_root;
  for (int i = 0; i < count; ++i) {
    if (used[i]) by_root[root(i)].push_back(i);
  }
  std::vector<std::vector<int>> blocks;
  blocks.reserve(by_root.size());
  for (auto& [unused, members] : by_root) blocks.push_back(std::move(members));
  std::sort(blocks.begin(), blocks.end());
  return blocks;
}

template <class C>
RankReport ReportFromEchelon(const RowEchelon<C>& echelon, const std::vector<int>& states) {
  const DynamicMatrix<C> basis = NullSpace(echelon);
  std::vector<std::vector<int>> supports;
  for (Eigen::Index k = 0; k < basis.cols(); ++k) {
    std::vector<int> support;
    for (Eigen::Index i = 0; i < basis.rows(); ++i) {
      if (PivotSize(basis(i, k)) > 0.0) support.push_back(static_cast<int>(i));
    }
    supports.push_back(support);
  }
  RankReport report;
  report.states = states;
  report.rank = static_cast<int>(echelon.pivots.size());
  int joint = 0;
  for (const auto& members : ConnectedStates(supports, static_cast<int>(states.size()))) {
    NullBlock block;
    std::vector<Eigen::Index> vectors;
    for (const int i : members) {
      block.states.push_back(states[i]);
      const auto at = std::find(echelon.free.begin(), echelon.free.end(), i);
      if (at == echelon.free.end()) continue;
      block.free.push_back(states[i]);
      vectors.push_back(at - echelon.free.begin());
    }
    block.support.resize(members.size(), vectors.size());
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t k = 0; k < vectors.size(); ++k) {
        block.support(i, k) = PivotSize(basis(members[i], vectors[k])) > 0.0 ? 1.0 : 0.0;
      }
    }
    if (members.size() > 1) block.label = fmt::format("J{}", ++joint);
    report.blocks.push_back(block);
  }
  return report;
}

template <class C>
DynamicMatrix<C> Columns(const DynamicMatrix<C>& matrix, const std::vector<int>& states) {
  DynamicMatrix<C> selected(matrix.rows(), static_cast<Eigen::Index>(states.size()));
  for (std::size_t i = 0; i < states.size(); ++i) selected.col(i) = matrix.col(states[i]);
  return selected;
}

// A single null vector is scaled so that its first considerable component (at least a tenth of the
// largest, in typical sizes) is 1.
void ScaleToFirstLarge(const std::vector<StateInfo>& info, NullBlock* block) {
  Eigen::VectorXd parts = block->directions.col(0).cwiseAbs();
  for (Eigen::Index i = 0; i < parts.size(); ++i) parts[i] /= info[block->states[i]].typical;
  Eigen::Index first = 0;
  while (parts[first] < 0.1 * parts.maxCoeff()) ++first;
  block->directions /= block->directions(first, 0);
}

}  // namespace

std::string RankReport::StatusOf(int state) const {
  for (const NullBlock& block : blocks) {
    const auto& members = block.states;
    if (std::find(members.begin(), members.end(), state) == members.end()) continue;
    return block.label.empty() ? "unobservable" : "joint: " + block.label;
  }
  return "ok";
}

RankReport ExactRank(const DynamicMatrix<Modular>& observability, const std::vector<int>& states) {
  return ReportFromEchelon(RowReduce<Modular>(Columns(observability, states), true), states);
}

void FillDirections(const Eigen::MatrixXd& observability, const std::vector<StateInfo>& info,
                    RankReport* report) {
  for (NullBlock& block : report->blocks) {
    std::vector<int> bound;
    for (const int state : block.states) {
      if (std::find(block.free.begin(), block.free.end(), state) == block.free.end()) {
        bound.push_back(state);
      }
    }
    Eigen::MatrixXd a = Columns<double>(observability, bound);
    const Eigen::MatrixXd b = -Columns<double>(observability, block.free);
    for (std::size_t j = 0; j < bound.size(); ++j) a.col(j) *= info[bound[j]].typical;
    const Eigen::MatrixXd solved =
        bound.empty() ? Eigen::MatrixXd()
                      : Eigen::MatrixXd(a.completeOrthogonalDecomposition().solve(b));
    block.directions.setZero(block.states.size(), block.free.size());
    for (std::size_t i = 0; i < block.states.size(); ++i) {
      const auto at = std::find(bound.begin(), bound.end(), block.states[i]);
      for (std::size_t k = 0; k < block.free.size(); ++k) {
        block.directions(i, k) = at == bound.end()
                                     ? (block.states[i] == block.free[k] ? 1.0 : 0.0)
                                     : solved(at - bound.begin(), k) * info[*at].typical;
      }
    }
    block.directions = block.directions.cwiseProduct(block.support);
    if (block.free.size() == 1) ScaleToFirstLarge(info, &block);
  }
}

RankReport NumericalRank(const Eigen::MatrixXd& matrix, const std::vector<int>& states,
                         double tolerance) {
  const Eigen::MatrixXd selected = Columns<double>(matrix, states);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(selected, Eigen::ComputeFullV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  const double cut = sigma.size() > 0 ? tolerance * sigma[0] : 0.0;
  const auto rank = (sigma.array() > cut).count();
  // The reduced row space; entries at rounding level do not couple states.
  Eigen::MatrixXd row_space = svd.matrixV().leftCols(rank).transpose();
  RowEchelon<double> echelon = RowReduce<double>(row_space, true, 1e-6);
  echelon.rows = (echelon.rows.array().abs() < 1e-3).select(0.0, echelon.rows);
  RankReport report = ReportFromEchelon(echelon, states);
  report.exact = false;
  return report;
}

}  // namespace trueline
