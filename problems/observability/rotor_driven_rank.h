// The exact observability of the rotor-driven model (Boehm et al. 2020, table I).
#pragma once

#include <vector>

#include "problems/observability/rank.h"
#include "problems/observability/rotor_driven_points.h"

namespace trueline {

// Rank and null space for `states` (error states; all others are known), with null vectors in
// physical units at a point near `nominal` (kStates numbers). The rank is the larger one of two
// random points; it is wrong with a probability below 1e-14. Throws InputError if the vehicle
// cannot fly the motion.
RankReport RotorDrivenRank(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                           const std::vector<int>& states, Motion motion, std::uint64_t seed = 0);

}  // namespace trueline
