// Products with small matrices of a fixed number of rows, column by column. Eigen's general product
// first packs its factors, which takes longer than these products.
#pragma once

#include <Eigen/Core>

namespace trueline {

// *sum += factor a b. `sum` must not be part of b.
template <class A, class B, class Sum>
void AddProduct(double factor, const A& a, const B& b, Sum&& sum) {
  constexpr int kRows = A::RowsAtCompileTime;
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    Eigen::Matrix<double, kRows, 1> column = sum.col(j);
    for (Eigen::Index k = 0; k < a.cols(); ++k) column += (factor * b.coeff(k, j)) * a.col(k);
    sum.col(j) = column;
  }
}

// b = a b for square a.
template <class A, class B>
void MultiplyLeft(const A& a, B&& b) {
  constexpr int kSize = A::RowsAtCompileTime;
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    Eigen::Matrix<double, kSize, 1> column = Eigen::Matrix<double, kSize, 1>::Zero();
    for (int k = 0; k < kSize; ++k) column += b.coeff(k, j) * a.col(k);
    b.col(j) = column;
  }
}

}  // namespace trueline
