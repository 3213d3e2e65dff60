// The hypotheses that a diagnosis of the rotor-driven model tests.
#pragma once

#include "problems/diagnosis/catalogue.h"
#include "problems/rotor_data/rotor_data.h"
#include "problems/rotor_data/rotor_prior.h"

namespace trueline {

const std::vector<const EffectInfo*>& RotorCatalogue();

// All candidates for a flight: each effect, one rotor_loss for each rotor, step effects at several
// times. Drag and inflow are left out where the base fit estimates them, the ground effect where
// the flight is not above p_z = 0.
std::vector<Candidate> RotorCandidatesFor(const RotorData& data, int rotors,
                                          const RotorPrior& prior);

// The same step effect at other times: `count` times within +-`range` s of the candidate's.
std::vector<Candidate> StepsAround(const Candidate& candidate, double range, int count);

bool IsStep(const Candidate& candidate);
// Seconds between the times that RotorCandidatesFor tries for a step effect. The best time is
// refined on as many finer times between its neighbours.
double StepSpacing(const RotorData& data);
inline constexpr int kFinerSteps = 4;

}  // namespace trueline
