// What a diagnosis may say: which causes are named, the verdict, and what model.yaml holds.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

class DiagnosedFlight;
class Linearisation;
struct Found;
struct Rounds;

// True if held-out flight is predicted better by one measure, and not worse by both together.
bool ClearGain(const Gains& gains);

// True if held-out flight is predicted worse by one measure with 95 %, better by none, and worse by
// both together.
bool ClearLoss(const Gains& gains);

// The sum from which on a cause is named.
double EvidenceNeeded(double alpha);

// The parts of a sum, without those that say nothing.
std::string PartsText(const EvidenceSum& evidence);

// Why a cause is not named: its evidence is less than a chance `alpha` of a false cause demands.
// Empty if it is named.
std::string WhyNotNamed(const Cause& cause, double alpha);
// Stores what the witness and the further flights say. Where these are references: whether they
// share the cause; if not, the flight speaks for a change alone.
void AddOthersEvidence(const SearchOptions& options, Cause* cause);
// True if the flight shows the cause and its witness, or other flights, show that it is absent.
bool Refuted(const Cause& cause, double alpha);

// True for a named cause that can be relied on: another flight or its witness confirms it, or there
// is no other flight.
bool Claimed(const Cause& cause);

// clean | explained | ambiguous | unexplained. A flight is explained if all causes can be relied on
// and no significant misfit remains. `terms_repeat`: terms that other flights show explain some of
// it. `alpha`: as for WhyNotNamed.
std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by, double alpha,
                      bool terms_repeat = false);

// Constants that cause `which` can't be told apart from: without their priors it is not
// significant, and they are correlated with it. `names`: of the fit's first columns.
std::vector<std::string> ConfusedConstants(const Linearisation& fit,
                                           const std::vector<Found>& found, std::size_t which,
                                           const std::vector<std::string>& names);

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
