// Gauss-Jordan elimination for exact numbers (Modular: any non-zero pivot) and for doubles (largest
// pivot; pivots below a tolerance are zero).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "cost_functions/numbers/modular.h"

namespace trueline {

inline double PivotSize(Modular value) { return value == Modular() ? 0.0 : 1.0; }
inline double PivotSize(double value) { return std::abs(value); }

template <class C>
using DynamicMatrix = Eigen::Matrix<C, Eigen::Dynamic, Eigen::Dynamic>;
template <class C>
using DynamicVector = Eigen::Matrix<C, Eigen::Dynamic, 1>;

template <class C>
struct RowEchelon {
  DynamicMatrix<C> rows;    // rank x columns, reduced: each pivot is 1 and alone in its column
  std::vector<int> pivots;  // the column of each row's pivot
  std::vector<int> free;    // the other columns
};

// Reduced row echelon form of `a`. With `from_right` columns are processed from the last to the
// first, so that free columns come as early as possible. `tolerance` applies to pivots of doubles.
template <class C>
RowEchelon<C> RowReduce(DynamicMatrix<C> a, bool from_right = false, double tolerance = 1e-10) {
  RowEchelon<C> result;
  int rank = 0;
  for (int step = 0; step < a.cols(); ++step) {
    const int column = static_cast<int>(from_right ? a.cols() - 1 - step : step);
    int best = rank;
    for (int row = rank; row < a.rows(); ++row) {
      if (PivotSize(a(row, column)) > PivotSize(a(best, column))) best = row;
    }
    if (rank >= a.rows() || PivotSize(a(best, column)) <= tolerance) {
      result.free.push_back(column);
      continue;
    }
    a.row(best).swap(a.row(rank));
    const C inverse = C(1.0) / a(rank, column);
    for (int j = 0; j < a.cols(); ++j) a(rank, j) *= inverse;
    for (int row = 0; row < a.rows(); ++row) {
      const C factor = a(row, column);
      if (row == rank || PivotSize(factor) == 0.0) continue;
      for (int j = 0; j < a.cols(); ++j) a(row, j) -= factor * a(rank, j);
    }
    result.pivots.push_back(column);
    ++rank;
  }
  result.rows = a.topRows(rank);
  return result;
}

// Basis of the null space, one column for each free column of the echelon: 1 there, 0 at the other
// free ones.
template <class C>
DynamicMatrix<C> NullSpace(const RowEchelon<C>& echelon) {
  const Eigen::Index columns =
      static_cast<Eigen::Index>(echelon.pivots.size() + echelon.free.size());
  DynamicMatrix<C> basis(columns, static_cast<Eigen::Index>(echelon.free.size()));
  basis.setConstant(C(0.0));
  for (std::size_t k = 0; k < echelon.free.size(); ++k) {
    basis(echelon.free[k], k) = C(1.0);
    for (std::size_t row = 0; row < echelon.pivots.size(); ++row) {
      basis(echelon.pivots[row], k) = -echelon.rows(row, echelon.free[k]);
    }
  }
  return basis;
}

}  // namespace trueline
