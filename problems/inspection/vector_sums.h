// Sums of pairs of vectors by block of time, and what follows from them: correlation, rotation.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "problems/inspection/vector_match.h"

namespace trueline {

inline constexpr int kBlocks = 10;
inline constexpr int kLeastPairs = 30;

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

// Zero for fewer than kLeastPairs. `any_turn`: under the best rotation or reflection.
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

}  // namespace trueline
