// Stepwise search for causes on a rotor-driven flight.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

// The result of the rounds. `found`, `p` (corrected for the size of the catalogue) and `confused`
// (ids that fit as well) are parallel lists.
struct RotorRounds {
  std::vector<RotorFound> found;
  std::vector<double> p;
  std::vector<std::vector<std::string>> confused;
  std::vector<CandidateReport> candidates;  // as tested in the first round
  std::vector<std::string> unexplained_by;  // terms that explain clearly more than any effect

  void Erase(std::size_t i) {
    found.erase(found.begin() + static_cast<long>(i));
    p.erase(p.begin() + static_cast<long>(i));
    confused.erase(confused.begin() + static_cast<long>(i));
  }
};

// One round for each cause: test all candidates, add the best, refit, drop causes that are no
// longer significant; stop when no candidate is significant. `chance`: of naming any cause where
// there is none, over all candidates. The search must be fitted without causes at entry; it ends
// fitted with those found.
RotorRounds SearchRotorCauses(std::vector<Candidate> candidates, double chance, int max_causes,
                              RotorSearch* search);

}  // namespace trueline
