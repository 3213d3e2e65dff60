// Two streams that measure one vector signal, in axes and on clocks of their own: the rotation or
// reflection between their axes, the ratio of their sizes, and how late one is against the other.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include "problems/inspection/clear.h"
#include "problems/log/flight_log.h"

namespace trueline {

struct VectorPair {
  double t;              // s
  Eigen::Vector3d seen;  // by the stream in question
  Eigen::Vector3d sure;  // by the reference, over the same time less the lag
};

// The pairs if the stream's stamps are too large by `lag` (s).
using PairsAt = std::function<std::vector<VectorPair>(double lag)>;

struct VectorMatch {
  double lag = 0.0;               // s; positive: the stream's stamps are too large; mid-flight
  double lag_sigma = 0.0;         // s
  double drift = 0.0;             // s/s, of the lag over the flight
  double drift_sigma = 0.0;       // s/s
  std::optional<double> or_else;  // s, another lag about as good, farther off: laps repeat
  double correlation = 0.0;       // at the lag, over all rotations and reflections; 1 is perfect
  double unshifted = 0.0;         // the same without the lag
  double unturned = 0.0;          // at the lag, without a rotation
  double plain = 0.0;             // at the lag, by the best of the 48 signed permutations

  // seen = gain turn sure, about the means. Orthogonal; a reflection only where the third axis
  // shows it at 5 sigma.
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d turn_cov = Eigen::Matrix3d::Zero();  // rad^2, in the stream's axes
  double reflection = 0.0;  // sigmas by which the sign of the determinant is shown
  // The best turn of the other handedness, where the third axis does not show which it is.
  std::optional<Eigen::Matrix3d> mirrored;
  double gain = 1.0, gain_sigma = 0.0;
  double seen_rms = 0.0;  // of `seen` about its mean
};

struct LagSearch {
  double reach = 5.0;  // s
  double step = 0.02;  // s, of the coarse search
};

// No value for fewer than kFewest pairs. The rotation over all of O(3) is Procrustes' (Schoenemann
// 1966); the lag maximises the sum of the singular values of the cross-covariance, which no
// rotation changes. Sigmas are those of the jackknife over ten blocks of time. Where these blocks
// show no common lag, a drift of up to 0.01 s/s is looked for and taken out of all else.
std::optional<VectorMatch> MatchVectors(const PairsAt& pairs, const LagSearch& search);

// One standard deviation of a statistic by its values without each of the blocks.
double JackknifeSigma(const std::vector<double>& without);

// Whether the ratio of sizes is off by more than noise in either stream explains.
bool HasOtherScale(const VectorMatch& match);
// Whether `slow`, of the slow motion alone, has another scale, too, and that of `match`: a filter
// changes fast motion, a scale changes slow motion as well.
bool HasSameScale(const VectorMatch& slow, const VectorMatch& match);

// Whether `turn` differs from the orthogonal `other` along some axis by more than 5 sigma and by
// more than `least` (rad).
bool Differs(const VectorMatch& match, const Eigen::Matrix3d& other, double least);

// The rotation by which `a` is turned against `b`, as a vector (rad).
Eigen::Vector3d TurnBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

// Whether `turn` is a rotation about the vertical, and its angle (rad) about down.
bool IsHeading(const Eigen::Matrix3d& turn);
double HeadingIn(const Eigen::Matrix3d& turn);

// The 48 axis permutations with signs, the identity first, then the other 23 rotations.
const std::vector<Eigen::Matrix3d>& SignedPermutations();

// The match's `turn`, or a signed permutation that it does not differ from: the identity, a
// rotation, a reflection, in this order.
Eigen::Matrix3d PlainTurn(const VectorMatch& match, double least);

// Fixes beside mocap's positions.

// At most 1,500 fixes, each beside mocap's position at the same time less the lag; fixes where
// mocap has a gap are left out. `log` must outlive what is returned.
PairsAt FixPairs(const FlightLog& log);

// Sums of pairs of vectors by block of time, and what follows from them: correlation, rotation.

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
template <class Sums>
Sums Total(const std::array<Sums, kBlocks>& blocks) {
  Sums total;
  for (const Sums& block : blocks) total += block;
  return total;
}
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

template <int kX, int kY>
NormalSums<kX, kY> operator-(NormalSums<kX, kY> all, const NormalSums<kX, kY>& part) {
  return all -= part;
}

}  // namespace trueline
