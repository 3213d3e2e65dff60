#include "problems/diagnosis/explanation.h"

#include <algorithm>
#include <set>
#include <utility>

#include "problems/diagnosis/thresholds.h"

namespace trueline {
namespace {

using Ids = std::set<std::string>;

std::vector<std::string> Listed(const Ids& ids) { return {ids.begin(), ids.end()}; }

// The significant, plausible effect of the greatest merit, or null.
const Tested* Greatest(const std::vector<Tested>& tested, double alpha) {
  const Tested* best = nullptr;
  for (const Tested& t : tested) {
    if (t.Significant(alpha) && (best == nullptr || t.Merit() > best->Merit())) best = &t;
  }
  return best;
}

// Of the significant effects that fit as well as the best, the one with the fewest parameters.
const Tested* Simplest(const std::vector<Tested>& tested, double alpha, double merit) {
  const auto key = [](const Tested& t) { return std::make_pair(-t.value.size(), t.Merit()); };
  const Tested* simplest = nullptr;
  for (const Tested& t : tested) {
    if (!t.Significant(alpha) || t.Merit() < merit - kAsGood) continue;
    if (simplest == nullptr || key(t) > key(*simplest)) simplest = &t;
  }
  return simplest;
}

// The other effects that fit equally well, by id; by label where it is the same effect of another
// gate or rotor. A step at a neighbouring time is the same step.
Ids FitAsWell(const std::vector<Tested>& tested, const Tested& best) {
  Ids ids;
  for (const Tested& t : tested) {
    if (t.Merit() <= best.Merit() - kAsGood || !Plausible(t.candidate, t.value)) continue;
    const bool same = t.IsOf(best.candidate.id());
    if (same && t.candidate.IsStep()) continue;
    ids.insert(same ? t.candidate.Label() : t.candidate.id());
  }
  ids.erase(best.candidate.Label());
  return ids;
}

// Effects that could replace one of a pair while the other is kept.
Ids InPlaceOf(const Tested& replaced, const Tested& kept, const std::vector<TestedPair>& pairs,
              double merit) {
  Ids ids;
  for (const TestedPair& pair : pairs) {
    if (pair.merit < merit || !pair.Has(kept.candidate.id()) || pair.Has(replaced.candidate.id())) {
      continue;
    }
    const bool first = pair.first.IsOf(kept.candidate.id());
    ids.insert((first ? pair.second : pair.first).candidate.id());
  }
  return ids;
}

}  // namespace

Explanation Explain(const FlightEvidence& evidence, double alpha) {
  const Tested* greatest = Greatest(evidence.tested(), alpha);
  if (greatest == nullptr) return {};
  Tested best = *Simplest(evidence.tested(), alpha, greatest->Merit());
  double linear = 0.0, with_best = greatest->Merit();
  for (const Tested& t : evidence.tested()) {
    if (t.Significant(alpha)) linear = std::max(linear, t.LinearMerit());
  }
  const std::vector<TestedPair> pairs = evidence.Pairs(alpha, linear - kAsGood);
  const TestedPair* rival = nullptr;  // the best pair without `best`
  for (const TestedPair& pair : pairs) {
    if (pair.Has(best.candidate.id())) {
      with_best = std::max(with_best, pair.merit);
    } else if (rival == nullptr || pair.merit > rival->merit) {
      rival = &pair;
    }
  }
  if (rival != nullptr && rival->merit > with_best + kAsGood) {
    const double as_good = rival->merit - kAsGood;
    Tested first = rival->first, second = rival->second;
    first.confused = Listed(InPlaceOf(first, second, pairs, as_good));
    second.confused = Listed(InPlaceOf(second, first, pairs, as_good));
    return {{first, second}, rival->merit};
  }
  Ids confused = FitAsWell(evidence.tested(), best);
  for (const TestedPair& pair : pairs) {
    if (pair.Has(best.candidate.id()) || pair.merit < with_best - kAsGood) continue;
    confused.insert(pair.first.candidate.id());
    confused.insert(pair.second.candidate.id());
  }
  best.confused = Listed(confused);
  return {{best}, with_best};
}

}  // namespace trueline
