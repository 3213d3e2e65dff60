// Blind arcs of a run and the ellipses stated for their ends.
#pragma once

#include <gtest/gtest.h>

#include "problems/result/estimate.h"
#include "problems/result/statistics.h"

namespace trueline {

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
