// The search for causes in rounds: all candidates are tested, the best one is taken, the model is
// refitted, and what another cause explains away goes.
#pragma once

#include "problems/diagnosis/search.h"

namespace trueline {

// Causes in the model, in the order in which they were found.
struct Rounds {
  std::vector<Found> found;
  std::vector<double> p;  // corrected for the number of candidates
  std::vector<std::vector<std::string>> confused;
  std::vector<CandidateReport> candidates;  // all that were tried, tested alone
  std::vector<std::string> goes_with;       // terms that no effect stands for, strongest first

  void Remove(std::size_t which);
};

// Rounds until nothing stands out; `search` ends fitted with what was found.
Rounds SearchCauses(const std::vector<Candidate>& candidates, const DiagnosisOptions& options,
                    CauseSearch* search);

// Refits a model with causes to convergence.
void Refit(CauseSearch* search, std::vector<Found>* found);

}  // namespace trueline
