// What model.yaml holds.
#pragma once

#include "problems/diagnosis/rounds.h"

namespace trueline {

// Chooses the causes that can be relied on, unless held-out flight is predicted worse with them,
// and the terms that no other flight contradicts; stores them and the constants fitted with them.
// `flight`: its last Fit has the causes of `rounds`, then `terms`; it ends fitted with what is
// chosen.
void ChooseModel(const Rounds& rounds, const std::vector<Found>& terms, DiagnosedFlight* flight,
                 Diagnosis* diagnosis);

// What a model lacks was significant, so that the constants may be those of the fit with it: the
// intervals of `without` come to contain both.
void WidenByChange(const std::vector<ParameterEstimate>& with,
                   std::vector<ParameterEstimate>* without);

}  // namespace trueline
