// The errors that a filter estimates: those of the node (moving state and drift) and of the unknown
// constants. Known constants have no rows and columns in the covariance.
#pragma once

#include <utility>
#include <vector>

#include "problems/chain/small_product.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

class Unknowns {
 public:
  static constexpr int kMoving = RotorAeroModel::kMovingErrors;
  static constexpr int kMost = kNodeErrors + RotorAeroModel::kConstants;
  using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  // Columns of the unknowns.
  template <int kRows>
  using Rows = Eigen::Matrix<double, kRows, Eigen::Dynamic, 0, kRows, kMost>;

  explicit Unknowns(std::vector<int> free) : free_(std::move(free)) {}

  int size() const { return kNodeErrors + num_constants(); }
  int num_constants() const { return static_cast<int>(free_.size()); }
  // Index of the k-th unknown constant among all constants.
  int constant(int k) const { return free_[static_cast<std::size_t>(k)]; }

  // Columns by all errors of the state (RotorState), as columns by the unknowns; zero by the drift.
  template <class Derived>
  Rows<Derived::RowsAtCompileTime> Of(const Eigen::MatrixBase<Derived>& whole) const {
    Rows<Derived::RowsAtCompileTime> rows(whole.rows(), size());
    rows.template leftCols<kMoving>() = whole.template leftCols<kMoving>();
    rows.template middleCols<3>(kDriftError).setZero();
    for (int k = 0; k < num_constants(); ++k) {
      rows.col(kNodeErrors + k) = whole.col(kMoving + constant(k));
    }
    return rows;
  }
  // All errors of the state, without the drift; zero for known constants.
  template <class Derived>
  RotorError Whole(const Eigen::MatrixBase<Derived>& error) const {
    RotorError whole = RotorError::Zero();
    whole.template head<kMoving>() = error.template head<kMoving>();
    for (int k = 0; k < num_constants(); ++k) {
      whole[kMoving + constant(k)] = error[kNodeErrors + k];
    }
    return whole;
  }
  RotorErrorMatrix WholeCovariance(const Covariance& cov) const {
    RotorErrorMatrix whole = RotorErrorMatrix::Zero();
    for (int i = 0; i < kMoving; ++i) whole.col(i) = Whole(cov.col(i));
    for (int k = 0; k < num_constants(); ++k) {
      whole.col(kMoving + constant(k)) = Whole(cov.col(kNodeErrors + k));
    }
    return whole;
  }

 private:
  std::vector<int> free_;
};

// Product of a matrix with few rows and a covariance.
template <int kRows>
Unknowns::Rows<kRows> Times(const Unknowns::Rows<kRows>& rows, const Unknowns::Covariance& cov) {
  Unknowns::Rows<kRows> product = Unknowns::Rows<kRows>::Zero(kRows, cov.cols());
  AddProduct(1.0, rows, cov, product);
  return product;
}

}  // namespace trueline
