// A match of pairs of vectors by one lag for the whole flight.
#pragma once

#include <optional>

#include "problems/inspection/vector_match.h"

namespace trueline {

inline constexpr double kShown = 5.0;  // sigmas

// A match by one lag, and what the blocks of the flight show of it.
struct SteadyMatch {
  VectorMatch match;
  int shown = 0;                // blocks that show their lag
  double from = 0.0, to = 0.0;  // s, of the pairs
};

// No value for fewer than 30 pairs.
std::optional<SteadyMatch> MatchSteady(const PairsAt& pairs, const LagSearch& search);

}  // namespace trueline
