#include "problems/rotor_diagnosis/rotor_rounds.h"

#include <algorithm>

#include "problems/diagnosis/choose.h"

namespace trueline {
namespace {

// An effect that was found is not looked for again, but for the loss of another rotor.
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
  report.detectable = SizesFromSteps(*t.candidate.info, DetectableSize(t.test, alpha, clusters));
  return report;
}

// A step's time, to a fraction of the spacing of those that were tried.
RotorFound Refined(const RotorTested& best, RotorSearch* search) {
  RotorTested sharp = best;
  if (best.candidate.fixed.count("t_step") > 0) {
    constexpr int kTried = 17;
    double range = StepSpacing(search->world().data);
    for (int round = 0; round < 2; ++round, range /= 8.0) {
      for (RotorTested& t : search->Test(StepsAround(sharp.candidate, range, kTried))) {
        if (t.gain > sharp.gain && Plausible(t.candidate, t.value)) sharp = t;
      }
    }
  }
  return {sharp.candidate, sharp.value};
}

// True where the vehicle itself moves in a way that is clearly no effect's. Readings that are off
// leave its motion to be explained.
bool BeyondEffects(const std::vector<RotorDescribed>& described, double alpha, double merit,
                   std::vector<std::string>* names) {
  bool beyond = false;
  names->clear();
  for (const RotorDescribed& d : described) {
    if (!d.Stands(alpha, d.of_sensor ? 0.0 : merit)) continue;
    names->push_back(d.name);
    beyond = beyond || !d.of_sensor;
  }
  return beyond;
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
    const std::vector<RotorTested> tested = search->TestAll(Without(candidates, rounds.found));
    if (round == 0) {
      for (const RotorTested& t : tested) {
        rounds.candidates.push_back(Report(t, alpha, search->clusters()));
      }
    }
    const RotorTested* best = Best(tested, alpha);
    const double merit = best == nullptr ? 0.0 : best->Merit();
    const bool beyond = BeyondEffects(search->described(), chance, merit, &rounds.unexplained_by);
    if (best == nullptr || round == max_causes || beyond) break;
    rounds.p.push_back(std::min(1.0, best->p * tried));
    rounds.confused.push_back(ConfusedWith(tested, *best));
    rounds.found.push_back(Refined(*best, search));
    search->Fit(&rounds.found);
    while (DropExplainedAway(*search, alpha, &candidates, &rounds)) search->Fit(&rounds.found);
  }
  return rounds;
}

}  // namespace trueline
