#include "problems/rotor_diagnosis/rotor_rounds.h"

#include <algorithm>

#include "problems/diagnosis/choose.h"
#include "problems/rotor_diagnosis/rotor_explanation.h"

namespace trueline {
namespace {

// Removes effects that were found; losses of other rotors stay candidates.
std::vector<Candidate> Without(std::vector<Candidate> candidates,
                               const std::vector<RotorFound>& found) {
  std::erase_if(candidates, [&](const Candidate& c) {
    return std::any_of(found.begin(), found.end(), [&](const RotorFound& f) {
      const bool other_rotor = c.fixed.count("rotor") > 0 && f.candidate.fixed != c.fixed;
      return f.candidate.info->id == c.info->id && !other_rotor;
    });
  });
  return candidates;
}

CandidateReport Report(const RotorTested& t, double alpha, int clusters) {
  CandidateReport report = NamedReport(t.candidate, t.test.z(), t.p);
  report.value = t.value;
  report.sigma = SizesFromSteps(*t.candidate.info, t.test.sigma);
  report.detectable =
      SizesFromSteps(*t.candidate.info, DetectableSize(t.test, alpha / t.tried, clusters));
  return report;
}

// The best time of a step effect among `count` within +-`range` s of the candidate's.
RotorTested BestStep(const Candidate& candidate, double range, int count,
                     const RotorSearch& search) {
  const std::vector<RotorTested> tested = search.Test(StepsAround(candidate, range, count));
  return *std::max_element(
      tested.begin(), tested.end(),
      [](const RotorTested& a, const RotorTested& b) { return a.gain < b.gain; });
}

// Replaces each kind of step effect by its best time, refined between the neighbouring times.
std::vector<Candidate> Sharpened(std::vector<Candidate> candidates, const RotorSearch& search) {
  std::vector<Candidate> steps;
  for (const Candidate& c : candidates) {
    if (IsStep(c)) steps.push_back(c);
  }
  const std::vector<RotorTested> tested = search.Test(steps);
  const double spacing = StepSpacing(search.world().data);
  const double range = spacing * (kFinerSteps - 1) / kFinerSteps;
  for (const std::size_t i : BestOfEach(tested)) {
    const Candidate& coarse = tested[i].candidate;
    const auto replaced = std::find_if(
        candidates.begin(), candidates.end(),
        [&](const Candidate& c) { return c.info == coarse.info && c.fixed == coarse.fixed; });
    *replaced = BestStep(coarse, range, 2 * kFinerSteps - 1, search).candidate;
  }
  return candidates;
}

// Refines a step's time to a fraction of the spacing of the times tried.
RotorFound Refined(const RotorTested& best, const RotorSearch& search) {
  if (!IsStep(best.candidate)) return {best.candidate, best.value};
  constexpr int kTried = 17;
  RotorTested sharp = best;
  double range = StepSpacing(search.world().data) / kFinerSteps;
  for (int round = 0; round < 2; ++round, range /= 8.0) {
    const RotorTested t = BestStep(sharp.candidate, range, kTried, search);
    if (Plausible(t.candidate, t.value)) sharp = t;
  }
  return {sharp.candidate, sharp.value};
}

// Terms that explain clearly more than `merit`. Sensor terms do not explain the vehicle's motion,
// so they are compared with zero merit.
std::vector<RotorDescribed> Standing(const RotorEvidence& evidence, double alpha, double merit) {
  std::vector<RotorDescribed> standing;
  for (const RotorDescribed& d : evidence.described()) {
    if (d.Stands(alpha, d.of_sensor ? 0.0 : merit)) standing.push_back(d);
  }
  return standing;
}

// True if the vehicle's motion clearly differs from that of every effect. An effect of an
// impossible size does not count: it may be significant only because a correlated effect is missing
// from the model, and such effects are searched first.
bool BeyondEffects(const std::vector<RotorDescribed>& standing) {
  return std::any_of(standing.begin(), standing.end(),
                     [](const RotorDescribed& d) { return !d.of_sensor && !d.columns.empty(); });
}

// Drops causes that are no longer significant once the terms in `standing` are nuisances.
bool DropStandIns(const RotorEvidence& evidence, const std::vector<RotorDescribed>& standing,
                  const RotorSearch& search, double alpha, RotorRounds* rounds) {
  std::vector<int> beside;
  for (const RotorDescribed& d : standing) {
    beside.insert(beside.end(), d.columns.begin(), d.columns.end());
  }
  std::vector<double> p;
  for (std::size_t i = 0; i < rounds->found.size(); ++i) {
    p.push_back(search.TestFoundBeside(rounds->found, i, evidence.normal(), beside).p());
  }
  for (std::size_t i = p.size(); i-- > 0;) {
    if (p[i] >= alpha) rounds->Erase(i);
  }
  return rounds->found.size() < p.size();
}

bool DropExplainedAway(const RotorSearch& search, double alpha, std::vector<Candidate>* candidates,
                       RotorRounds* rounds) {
  for (std::size_t i = rounds->found.size(); i-- > 0;) {
    const RotorFound& f = rounds->found[i];
    const double p = search.TestFound(rounds->found, i).p();
    if (p < alpha && Plausible(f.candidate, f.value)) continue;
    *candidates = Without(*candidates, {f});
    rounds->Erase(i);
    return true;
  }
  return false;
}

}  // namespace

RotorRounds SearchRotorCauses(std::vector<Candidate> candidates, double chance, int max_causes,
                              RotorSearch* search) {
  const int tried = std::max(1, DistinctIds(candidates));
  const double alpha = chance / tried;
  RotorRounds rounds;
  for (int round = 0; round <= max_causes; ++round) {
    const RotorEvidence evidence =
        search->TestAll(Sharpened(Without(candidates, rounds.found), *search));
    if (round == 0) {
      for (const RotorTested& t : evidence.tested()) {
        rounds.candidates.push_back(Report(t, alpha, search->clusters()));
      }
    }
    const RotorExplanation best = Explain(evidence, alpha);
    const std::vector<RotorDescribed> standing = Standing(evidence, chance, best.merit);
    rounds.unexplained_by.clear();
    for (const RotorDescribed& d : standing) rounds.unexplained_by.push_back(d.name);
    if (BeyondEffects(standing)) {
      if (DropStandIns(evidence, standing, *search, alpha, &rounds)) search->Fit(&rounds.found);
      break;
    }
    if (best.effects.empty()) break;
    if (static_cast<int>(rounds.found.size()) >= max_causes) break;
    for (std::size_t i = 0; i < best.effects.size(); ++i) {
      rounds.p.push_back(std::min(1.0, best.effects[i].p * tried));
      rounds.confused.push_back(best.confused[i]);
      rounds.found.push_back(Refined(best.effects[i], *search));
    }
    search->Fit(&rounds.found);
    while (DropExplainedAway(*search, alpha, &candidates, &rounds)) search->Fit(&rounds.found);
  }
  return rounds;
}

}  // namespace trueline
