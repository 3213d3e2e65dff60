// Stepwise search for causes. Each round tests all candidates, adds the best one, refits the model
// and drops causes that are no longer significant.
#pragma once

#include "problems/diagnosis/search.h"

namespace trueline {

// Causes in the model, in the order in which they were found.
struct Rounds {
  std::vector<Found> found;
  std::vector<double> p;  // corrected for the number of candidates
  std::vector<std::vector<std::string>> confused;
  std::vector<CandidateReport> candidates;  // all that were tested, each singly
  std::vector<std::string> goes_with;       // significant library terms, strongest first

  void Remove(std::size_t which);
};

// Runs rounds until no candidate is significant; `search` ends fitted with the causes found.
Rounds SearchCauses(const std::vector<Candidate>& candidates, const DiagnosisOptions& options,
                    CauseSearch* search);

// Refits a model with causes to convergence.
void Refit(CauseSearch* search, std::vector<Found>* found);

}  // namespace trueline
