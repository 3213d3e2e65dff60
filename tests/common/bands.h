// Two-sided bands from statistics, for tests whose seeds are fixed.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "problems/result/estimate.h"
#include "problems/result/statistics.h"

namespace trueline {

// Probability, on each side of a band, that correct code fails with new seeds.
inline constexpr double kChance = 1e-3;

// `sum` is that of `freedom` independent squared errors, each divided by its stated variance.
inline void ExpectChiSquare(double sum, double freedom, const std::string& what) {
  EXPECT_GT(sum, ChiSquareCritical(1.0 - kChance, freedom)) << what << ": sigmas are too large";
  EXPECT_LT(sum, ChiSquareCritical(kChance, freedom)) << what << ": sigmas are too small";
}

// `inside` of `count` independent intervals contain the truth, each with probability p.
inline void ExpectCoverage(int inside, int count, double p, const std::string& what) {
  EXPECT_GT(BinomialCdf(inside, count, p), kChance) << what << ": " << inside << " of " << count;
  EXPECT_LT(BinomialCdf(inside - 1, count, p), 1.0 - kChance)
      << what << ": " << inside << " of " << count;
}

// A stated sigma agrees with the expected one within a factor.
inline void ExpectSigma(double sigma, double due, double factor, const std::string& what) {
  EXPECT_GT(sigma, due / factor) << what;
  EXPECT_LT(sigma, due * factor) << what;
}

// --- Blind arcs of a run and the ellipses stated for their ends.

struct ArcCount {
  int inside = 0;  // of the ellipse of 95 %
  int count = 0;
};

inline ArcCount CountArcs(const EstimatorRun& run) {
  ArcCount arcs;
  for (const WindowEstimate& window : run.windows) {
    if (!window.arc) continue;
    arcs.inside += window.arc->Inside95();
    ++arcs.count;
  }
  return arcs;
}

// That few arcs lie inside has a probability of 1 % at least.
inline void ExpectCovered(const ArcCount& arcs) {
  EXPECT_GE(BinomialCdf(arcs.inside, arcs.count, 0.95), 0.01)
      << arcs.inside << " of " << arcs.count;
}

}  // namespace trueline