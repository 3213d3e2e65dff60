#include "problems/diagnosis/cause_rounds.h"

#include <algorithm>

#include "problems/diagnosis/choose.h"

namespace trueline {

void Refit(CauseSearch* search, std::vector<Found>* found) {
  constexpr int kRefits = 8;  // at most
  search->Fit(found, kRefits);
}

void Rounds::Remove(std::size_t which) {
  found.erase(found.begin() + static_cast<long>(which));
  p.erase(p.begin() + static_cast<long>(which));
  confused.erase(confused.begin() + static_cast<long>(which));
}

namespace {

using Terms = std::vector<CauseSearch::Described>;

// Removes effects that were found. A step effect may occur once.
std::vector<Candidate> Without(std::vector<Candidate> candidates, const std::vector<Found>& found) {
  std::erase_if(candidates, [&](const Candidate& c) {
    return std::any_of(found.begin(), found.end(), [&](const Found& f) {
      const bool same_id = f.candidate.info->id == c.info->id;
      return same_id && (c.fixed.count("gate") == 0 || f.candidate.fixed == c.fixed);
    });
  });
  return candidates;
}

CandidateReport Report(const Tested& t, double alpha, int clusters) {
  CandidateReport report = NamedReport(t.candidate, t.test.z(), t.p);
  report.value = ValueOf(t);
  report.sigma = t.test.sigma;
  report.detectable = DetectableSize(t.test, alpha, clusters);
  return report;
}

// True if a force effect is fitted together with a drag that accelerates the vehicle (K_x or K_y
// positive by 3 sigmas): the two are strongly correlated and neither value is physical.
bool DrivesTheVehicle(const CauseSearch& search, const Found& f) {
  if (f.candidate.info->enters != EntersAt::kForce) return false;
  const ThetaVector value = search.Parameters(), sigma = search.Sigmas();
  return value[0] > 3.0 * sigma[0] || value[1] > 3.0 * sigma[1];  // K_x, K_y
}

// Drops the last cause that is no longer significant given the others, or no longer plausible, and
// excludes it from later rounds. True if one was dropped.
bool DropExplainedAway(const CauseSearch& search, double alpha, std::vector<Candidate>* candidates,
                       Rounds* rounds) {
  for (std::size_t i = rounds->found.size(); i-- > 0;) {
    const Found& f = rounds->found[i];
    const double p = search.TestFound(rounds->found, i).p();
    const bool plausible = Plausible(f.candidate, f.value) && !DrivesTheVehicle(search, f);
    if (p < alpha && plausible) continue;
    *candidates = Without(*candidates, {f});
    rounds->Remove(i);
    return true;
  }
  return false;
}

// Library terms that are significant and explain clearly more than any effect.
Terms Stands(Terms described, double alpha, double merit) {
  constexpr double kClearlyBetter = 10.0;  // of merit
  const double tried = static_cast<double>(described.size());
  std::erase_if(described, [&](const CauseSearch::Described& d) {
    return d.p * tried >= alpha || d.merit <= merit + kClearlyBetter;
  });
  return described;
}

// True if at least half of a cause's size is left in `test`, which has other columns as nuisances.
bool Keeps(const Found& f, const ScoreTest& test) {
  const Eigen::VectorXd alone = (f.value - f.candidate.Neutral()).cwiseQuotient(test.sigma);
  return alone.dot(test.value.cwiseQuotient(test.sigma)) > -0.5 * alone.squaredNorm();
}

// Drops causes that the strongest library term explains away, wholly or by more than half: such an
// effect only approximates the term.
void DropLikenesses(const Terms& terms, double alpha, CauseSearch* search, Rounds* rounds) {
  for (std::size_t i = rounds->found.size(); i-- > 0;) {
    const ScoreTest test = search->TestFound(rounds->found, i, terms.front().columns);
    if (test.p() < alpha && Keeps(rounds->found[i], test)) continue;
    rounds->Remove(i);
    Refit(search, &rounds->found);
  }
}

// Seconds between the times tried for a step effect; zero if there is none.
double StepSpacing(const std::vector<Candidate>& candidates) {
  double last = 0.0, spacing = 0.0;
  for (const Candidate& c : candidates) {
    const auto t = c.fixed.find("t_step");
    if (t == c.fixed.end()) continue;
    spacing = t->second - last;
    last = t->second;
  }
  return spacing;
}

// Refines the time of a step effect: three finer times to either side.
Tested Sharpened(const Tested& best, double spacing, CauseSearch* search) {
  constexpr int kReach = 3;
  const auto t = best.candidate.fixed.find("t_step");
  if (t == best.candidate.fixed.end()) return best;
  std::vector<Candidate> around;
  for (int k = -kReach; k <= kReach; ++k) {
    around.push_back(best.candidate);
    around.back().fixed["t_step"] = t->second + k * spacing / (2 * kReach + 1);
  }
  const std::vector<Tested> tested = search->TestAll(around);
  Tested sharp =
      *std::max_element(tested.begin(), tested.end(),
                        [](const Tested& a, const Tested& b) { return a.Merit() < b.Merit(); });
  sharp.p = best.p;  // already corrected for the number of times tried
  return sharp;
}

// Adds a cause to the model, refits, and drops causes that it explains away.
void Take(const Tested& best, double p, std::vector<std::string> confused, double alpha,
          CauseSearch* search, std::vector<Candidate>* candidates, Rounds* rounds) {
  rounds->found.push_back({best.candidate, ValueOf(best)});
  rounds->p.push_back(p);
  rounds->confused.push_back(std::move(confused));
  Refit(search, &rounds->found);
  while (DropExplainedAway(*search, alpha, candidates, rounds)) Refit(search, &rounds->found);
}

// An effect that is linearised far from its value may appear weaker than a library term that only
// approximates it. Adds the best effect on trial and removes it if such a term remains significant
// after the refit.
bool TakeOnTrial(const std::vector<Tested>& tested, const Tested& best, int tried,
                 const DiagnosisOptions& options, CauseSearch* search,
                 std::vector<Candidate>* candidates, Rounds* rounds) {
  const Rounds before = *rounds;
  const std::vector<Candidate> candidates_before = *candidates;
  const double alpha = options.alpha / tried;
  Take(best, std::min(1.0, best.p * tried), ConfusedWith(tested, best), alpha, search, candidates,
       rounds);
  const std::vector<Tested> left = search->TestAll(Without(*candidates, rounds->found));
  const Tested* next = Best(left, alpha);
  const double merit = next == nullptr ? 0.0 : next->Merit();
  if (Stands(search->TestLibrary(), options.alpha, merit).empty()) return true;
  *rounds = before;
  *candidates = candidates_before;
  Refit(search, &rounds->found);
  return false;
}

}  // namespace

Rounds SearchCauses(const std::vector<Candidate>& all, const DiagnosisOptions& options,
                    CauseSearch* search) {
  const int tried = std::max(1, DistinctIds(all));
  const double alpha = options.alpha / tried;
  const double spacing = StepSpacing(all);
  std::vector<Candidate> candidates = all;
  Rounds rounds;
  for (int round = 0; round <= options.max_causes; ++round) {
    const std::vector<Tested> tested = search->TestAll(Without(candidates, rounds.found));
    if (round == 0) {
      for (const Tested& t : tested) {
        rounds.candidates.push_back(Report(t, alpha, search->plan().clusters));
      }
    }
    const Tested* best = Best(tested, alpha);
    const double merit = best == nullptr ? 0.0 : best->Merit();
    const Terms terms = Stands(search->TestLibrary(), options.alpha, merit);
    const bool last = best == nullptr || round == options.max_causes;
    const Tested sharp = last ? Tested() : Sharpened(*best, spacing, search);
    if (!terms.empty()) {
      if (!last && TakeOnTrial(tested, sharp, tried, options, search, &candidates, &rounds)) {
        continue;
      }
      for (const auto& term : terms) rounds.goes_with.push_back(term.name);
      DropLikenesses(terms, alpha, search, &rounds);
      break;
    }
    if (last) break;
    Take(sharp, std::min(1.0, sharp.p * tried), ConfusedWith(tested, sharp), alpha, search,
         &candidates, &rounds);
  }
  return rounds;
}

}  // namespace trueline
