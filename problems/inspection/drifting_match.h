// A match of a stream whose clock drifts by more than a millisecond a second.
#pragma once

#include <optional>

#include "problems/inspection/vector_match.h"

namespace trueline {

// A match by one lag, and what the blocks of the flight show of it.
struct SteadyMatch {
  VectorMatch match;
  int shown = 0;                // blocks that show their lag
  double from = 0.0, to = 0.0;  // s, of the pairs
};

// No value for fewer than kFewest pairs.
std::optional<SteadyMatch> MatchSteady(const PairsAt& pairs, const LagSearch& search);

// The match of a clock that drifts by more than `steady` can show, if more blocks then lie on one
// line, and it explains clearly more or each block alone confirms it.
std::optional<VectorMatch> MatchDrifting(const PairsAt& pairs, const SteadyMatch& steady,
                                         const LagSearch& search);

}  // namespace trueline
