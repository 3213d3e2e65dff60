// Causes found one by one on a rotor-driven flight.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

// What the rounds come to. `found`, `p` (after the correction for the catalogue) and `confused`
// (ids that fit as well) go together.
struct RotorRounds {
  std::vector<RotorFound> found;
  std::vector<double> p;
  std::vector<std::vector<std::string>> confused;
  std::vector<CandidateReport> candidates;  // as the first round saw them
  std::vector<std::string> unexplained_by;  // terms that explain clearly more than any effect

  void Erase(std::size_t i) {
    found.erase(found.begin() + static_cast<long>(i));
    p.erase(p.begin() + static_cast<long>(i));
    confused.erase(confused.begin() + static_cast<long>(i));
  }
};

// One round for each cause: tests all, takes the best, refits, drops what is explained away, until
// nothing stands out. `chance` of naming a cause where there is none, over all candidates. The
// search must have been fitted without causes; it ends fitted with those found.
RotorRounds SearchRotorCauses(std::vector<Candidate> candidates, double chance, int max_causes,
                              RotorSearch* search);

}  // namespace trueline
