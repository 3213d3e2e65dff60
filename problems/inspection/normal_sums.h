// Sums of least squares y = X b, row by row; parts of the rows can be taken out again.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <type_traits>

namespace trueline {

// Rows of kX numbers for kY values that share them; one value is a number, several a vector.
template <int kX, int kY = 1>
struct NormalSums {
  using X = Eigen::Vector<double, kX>;
  using Y = std::conditional_t<kY == 1, double, Eigen::Vector<double, kY>>;

  Eigen::Matrix<double, kX, kX> a = Eigen::Matrix<double, kX, kX>::Zero();  // sum of x x^T
  Eigen::Matrix<double, kX, kY> b = Eigen::Matrix<double, kX, kY>::Zero();  // sum of x y^T
  Y yy = None();                                                            // of squares
  double n = 0.0;                                                           // rows

  void Add(const X& x, const Y& y) {
    a += x * x.transpose();
    if constexpr (kY == 1) {
      b += y * x;
      yy += y * y;
    } else {
      b += x * y.transpose();
      yy += y.cwiseAbs2();
    }
    n += 1.0;
  }
  NormalSums& operator+=(const NormalSums& o) {
    a += o.a;
    b += o.b;
    yy += o.yy;
    n += o.n;
    return *this;
  }
  NormalSums& operator-=(const NormalSums& o) {
    a -= o.a;
    b -= o.b;
    yy -= o.yy;
    n -= o.n;
    return *this;
  }
  // Sum of the residual's squares at `value`, for one y.
  double Cost(const X& value) const {
    return std::max(0.0, yy - 2.0 * b.dot(value) + value.dot(a * value));
  }

 private:
  static Y None() {
    if constexpr (kY == 1) {
      return 0.0;
    } else {
      return Y::Zero();
    }
  }
};

template <int kX, int kY>
NormalSums<kX, kY> operator-(NormalSums<kX, kY> all, const NormalSums<kX, kY>& part) {
  return all -= part;
}

}  // namespace trueline
