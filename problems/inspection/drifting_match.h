// A match of a stream whose clock drifts by more than a millisecond a second.
#pragma once

#include <optional>

#include "problems/inspection/steady_match.h"

namespace trueline {

// The match of a clock that drifts by more than `steady` can show, if more blocks then lie on one
// line, and it explains clearly more or each block alone confirms it.
std::optional<VectorMatch> MatchDrifting(const PairsAt& pairs, const SteadyMatch& steady,
                                         const LagSearch& search);

}  // namespace trueline
