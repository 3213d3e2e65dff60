// What a diagnosis may say: which significant causes are named, which of them can be relied on, and
// the verdict.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

class Linearisation;
struct Found;

// True if causes make held-out flight clearly worse by both measures combined.
bool Harmful(const Cause& cause);
// True if the model with causes predicts held-out flight worse than the model without them.
bool PredictsWorse(const Gain& arcs, const Gain& replays);

// True if held-out flight is predicted better by one measure, and not worse by both together.
bool ClearGain(const Gain& arcs, const Gain& replays);

// True if held-out flight is predicted worse by one measure with 95 %, better by none, and worse by
// both together.
bool ClearLoss(const Gain& arcs, const Gain& replays);

// Why a cause that is significant is not named; empty if it is. `gains`: they were measured.
// Reasons are: its witness refutes it; it makes held-out flight worse, if its witness shows it then
// clearly so, by more than the corrected sensor gains against mocap, or beside another flight that
// lacks it; the corrected sensor agrees worse with mocap on held-out flight; it is smaller than
// what the flight shows with good chance; neither held-out flight nor a witness nor another flight
// shows it; fewer than five independent arcs or replays are behind it.
std::string WhyNotNamed(const Cause& cause, bool gains);
bool Refuted(const Cause& cause);
// True if `next` names all causes that `best` names, and another one that held-out flight clearly
// shows.
bool NamesMore(const std::vector<Cause>& next, const std::vector<Cause>& best);
// Of the causes that their witnesses refute, the one of which its witness shows the smallest share;
// the end if there is none.
std::vector<Cause>::iterator MostRefuted(std::vector<Cause>* causes);

// True for a named cause that can be relied on: another flight or its witness confirms it, or there
// is no other flight.
bool Claimed(const Cause& cause);

// clean | explained | ambiguous | unexplained. A flight is explained if all causes can be relied on
// and no significant misfit remains. `terms_repeat`: terms that other flights show explain some of
// it.
std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by, bool terms_repeat = false);

// Constants that cause `which` can't be told apart from: without their priors it is not
// significant, and they are correlated with it. `names`: of the fit's first columns.
std::vector<std::string> ConfusedConstants(const Linearisation& fit,
                                           const std::vector<Found>& found, std::size_t which,
                                           const std::vector<std::string>& names);

}  // namespace trueline
