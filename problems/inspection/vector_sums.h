// Sums of pairs of vectors by block of time, and what follows from them: correlation, rotation.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "problems/inspection/clear.h"
#include "problems/inspection/vector_match.h"

namespace trueline {

// Sums from which all else follows; those of blocks add up.
struct VectorSums {
  double n = 0.0, seen2 = 0.0, sure2 = 0.0;
  Eigen::Vector3d seen = Eigen::Vector3d::Zero(), sure = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();

  void Add(const VectorPair& pair) {
    n += 1.0;
    seen += pair.seen;
    sure += pair.sure;
    seen2 += pair.seen.squaredNorm();
    sure2 += pair.sure.squaredNorm();
    cross += pair.seen * pair.sure.transpose();
  }
  VectorSums& operator+=(const VectorSums& o) { return Combine(o, 1.0); }
  VectorSums& operator-=(const VectorSums& o) { return Combine(o, -1.0); }
  VectorSums& Combine(const VectorSums& o, double sign) {
    n += sign * o.n;
    seen += sign * o.seen;
    sure += sign * o.sure;
    seen2 += sign * o.seen2;
    sure2 += sign * o.sure2;
    cross += sign * o.cross;
    return *this;
  }
  Eigen::Matrix3d Cov() const { return cross / n - seen / n * (sure / n).transpose(); }
  double SeenVar() const { return std::max(0.0, seen2 / n - (seen / n).squaredNorm()); }
  double SureVar() const { return std::max(0.0, sure2 / n - (sure / n).squaredNorm()); }
  double Scale() const { return std::sqrt(SeenVar() * SureVar()); }
};

using BlocksOfSums = std::array<VectorSums, kBlocks>;

// Zero for fewer than kFewest. `any_turn`: under the best rotation or reflection.
double Correlation(const VectorSums& sums, bool any_turn = true);
// Of one block under a given turn; NaN where it has too little.
double CorrelationUnder(const Eigen::Matrix3d& turn, const VectorSums& block);
// The best one under a signed permutation of the axes.
double PlainCorrelation(const VectorSums& sums);

struct TurnFit {
  Eigen::Matrix3d best;      // of either handedness
  Eigen::Matrix3d mirrored;  // the best one that is no rotation
  Eigen::Matrix3d rotation;  // the best one that is a rotation
  double third;  // signed gain in correlation by the best one over a change of handedness
};

TurnFit FitTurn(const VectorSums& sums);

// Of ten equal parts of the time from `from` to `to` (s).
BlocksOfSums BlockSums(const std::vector<VectorPair>& pairs, double from, double to);
VectorSums Total(const BlocksOfSums& blocks);
VectorSums SumOf(const std::vector<VectorPair>& pairs);

// A line through points of time and lag, its sigma by the scatter about it.
struct LagLine {
  double slope = 0.0;
  double sigma = std::numeric_limits<double>::infinity();
};

// Of fewer than five points no slope is known.
LagLine FitLagLine(const std::vector<Eigen::Vector2d>& points);

// The middle of a block, s from the start of the flight, which lasts `span`.
double BlockMiddle(std::size_t block, double span);

// Sums of least squares y = X b, row by row; parts of the rows can be taken out again.

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
