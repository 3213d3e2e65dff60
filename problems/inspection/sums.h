// Sums of pairs of vectors and of least squares: of a flight, and of its blocks of time, whose
// scatter gives sigmas.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <vector>

#include "problems/inspection/clear.h"

namespace trueline {

struct VectorPair {
  double t;              // s
  Eigen::Vector3d seen;  // by the stream in question
  Eigen::Vector3d sure;  // by the reference, over the same time less the lag
};

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

inline VectorSums SumOf(const std::vector<VectorPair>& pairs) {
  VectorSums sums;
  for (const VectorPair& pair : pairs) sums.Add(pair);
  return sums;
}

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
  NormalSums& operator+=(const NormalSums& o) { return Combine(o, 1.0); }
  NormalSums& operator-=(const NormalSums& o) { return Combine(o, -1.0); }
  NormalSums& Combine(const NormalSums& o, double sign) {
    a += sign * o.a;
    b += sign * o.b;
    yy += sign * o.yy;
    n += sign * o.n;
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

// Sums of each block of a flight, which add up.
template <class Sums>
using BlocksOf = std::array<Sums, kBlocks>;

template <class Sums>
Sums Total(const BlocksOf<Sums>& blocks) {
  Sums total;
  for (const Sums& block : blocks) total += block;
  return total;
}

// One standard deviation of a statistic by its values without each of the blocks.
inline double JackknifeSigma(const std::vector<double>& without) {
  double mean = 0.0, sum = 0.0;
  for (const double value : without) mean += value / static_cast<double>(without.size());
  for (const double value : without) sum += (value - mean) * (value - mean);
  return std::sqrt(sum * static_cast<double>(without.size() - 1) /
                   static_cast<double>(without.size()));
}
template <class Sums, class Statistic>
double JackknifeSigma(const BlocksOf<Sums>& blocks, const Statistic& of) {
  const Sums total = Total(blocks);
  std::vector<double> without;
  for (const Sums& block : blocks) {
    Sums rest = total;
    rest -= block;
    without.push_back(of(rest));
  }
  return JackknifeSigma(without);
}

}  // namespace trueline
