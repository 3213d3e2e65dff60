// Stepwise search for causes. Each round tests all candidates, adds the best effect or pair of
// effects to the model, fits again and drops causes that are no longer significant.
#pragma once

#include "problems/diagnosis/diagnosed_flight.h"
#include "problems/diagnosis/evidence.h"
#include "problems/diagnosis/score_test.h"

namespace trueline {

// What the first round says of each candidate, singly.
struct FirstRound {
  std::vector<CandidateReport> candidates;
  std::shared_ptr<const FlightEvidence> tests;  // in the order of `candidates`
  std::vector<Cause> shown;                     // named or not
};

struct Rounds {
  FirstRound first;
  std::vector<Found> found;           // causes in the model, in the order in which they were found
  std::vector<TestedTerm> remaining;  // significant terms that are no effect, strongest first
  std::vector<Cause> refuted;         // that a witness excluded before they were fitted
  std::vector<Candidate> impossible;  // significant in the last, of a size that no vehicle has
};

// Runs rounds until no candidate is significant. `flight` must be fitted without causes; it ends
// fitted with the causes found.
Rounds SearchCauses(const std::vector<Candidate>& candidates, const SearchOptions& options,
                    DiagnosedFlight* flight);

// A misfit of the merit `unstated` may be like an effect, whose size must exceed it to be named.
void WidenDetectable(const FlightEvidence& tests, double unstated, double alpha,
                     std::vector<CandidateReport>* reports);

// True if at least half of a cause's size is left in `test`, which has other columns as nuisances.
bool RetainsHalf(const Found& f, const ScoreTest& test);

// The merit of the strongest of them; zero for none.
double StrongestOf(const std::vector<TestedTerm>& terms);

// Terms that are no effect, and effects of impossible sizes, that are significant and explain
// clearly more than `merit`; strongest first. Held terms do not compete with effects, so they are
// compared with zero merit.
std::vector<TestedTerm> RemainingTerms(const FlightEvidence& evidence, double alpha,
                                       double merit = 0.0);

}  // namespace trueline
