// Two streams that measure one vector signal, in axes and on clocks of their own: the rotation or
// reflection between their axes, the ratio of their sizes, and how late one is against the other.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "problems/inspection/sums.h"

namespace trueline {

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

// 1 - correlation^2, the share of a signal's square that a match leaves.
inline double RestOf(double correlation) { return 1.0 - correlation * correlation; }

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

}  // namespace trueline
