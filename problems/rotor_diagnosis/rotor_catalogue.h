// The catalogue of effects that a diagnosis of the rotor-driven model looks for: one declaration
// each (see EffectInfo). Every size enters the forces in proportion, but that of the ground effect,
// which enters by its square.
#pragma once

#include "problems/diagnosis/catalogue.h"
#include "problems/rotor_data/rotor_data.h"
#include "problems/rotor_data/rotor_prior.h"

namespace trueline {

const std::vector<EffectInfo>& RotorCatalogue();
// `id` must be in the catalogue.
const EffectInfo& RotorInfoOf(const std::string& id);
bool EntersSquared(const EffectInfo& info);

// All candidates for a flight: each effect, losses rotor by rotor, steps by time. Drag and inflow
// are left out where the prior has them as unknowns of the base fit, the ground effect where the
// flight is not above p_z = 0.
std::vector<Candidate> RotorCandidatesFor(const RotorData& data, int rotors,
                                          const RotorPrior& prior);

// The same candidate with its step at another time: `count` times within +-`range` s.
std::vector<Candidate> StepsAround(const Candidate& candidate, double range, int count);

bool IsStep(const Candidate& candidate);
// Seconds between the times tried for a step by RotorCandidatesFor; the best is looked for among as
// many times more, evenly between.
double StepSpacing(const RotorData& data);
inline constexpr int kFinerSteps = 4;

}  // namespace trueline
