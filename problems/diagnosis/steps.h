// Times of step effects (a load that drops, drag that changes): the best one of those tried,
// refined.
#pragma once

#include "problems/diagnosis/evidence.h"

namespace trueline {

// The best coarse time is refined on as many finer times between its neighbours.
inline constexpr int kFinerSteps = 4;

// Replaces each kind of step effect's best time by a finer one.
std::vector<Candidate> WithRefinedSteps(std::vector<Candidate> candidates,
                                        const DiagnosedFlight& flight);

// The effect with its estimate; the time of a step effect refined to a fraction of kFinerSteps'
// spacing.
Found Refined(const Tested& effect, const DiagnosedFlight& flight);

}  // namespace trueline
