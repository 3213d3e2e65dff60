#include "problems/rotor_diagnosis/rotor_explanation.h"

#include <algorithm>
#include <set>

#include "problems/diagnosis/choose.h"

namespace trueline {
namespace {

using Ids = std::vector<std::string>;

// Ids in `more` that `ids` lacks, after them.
Ids United(const Ids& ids, const Ids& more) {
  std::set<std::string> all(ids.begin(), ids.end());
  all.insert(more.begin(), more.end());
  return {all.begin(), all.end()};
}

const std::string& IdOf(const RotorTested& t) { return t.candidate.info->id; }

// Of those that stand out and fit as well as the best, the one with the fewest parameters.
const RotorTested* Simplest(const std::vector<RotorTested>& tested, double alpha) {
  const RotorTested* best = Best(tested, alpha);
  const RotorTested* simplest = best;
  for (const RotorTested& t : tested) {
    const bool as_good =
        t.p < alpha && Plausible(t.candidate, t.value) && t.Merit() > best->Merit() - kAsGood;
    if (as_good && t.value.size() < simplest->value.size()) simplest = &t;
  }
  return simplest;
}

// What could stand in the place of one of the pair's effects, the other kept.
Ids InPlaceOf(const RotorTested& replaced, const RotorTested& kept,
              const std::vector<RotorPair>& pairs, double merit) {
  std::set<std::string> ids;
  for (const RotorPair& pair : pairs) {
    if (pair.merit < merit || !pair.Has(IdOf(kept)) || pair.Has(IdOf(replaced))) continue;
    ids.insert(pair.first.IsOf(IdOf(kept)) ? IdOf(pair.second) : IdOf(pair.first));
  }
  return {ids.begin(), ids.end()};
}

}  // namespace

RotorExplanation Explain(const RotorEvidence& evidence, double alpha) {
  const RotorTested* best = Simplest(evidence.tested(), alpha);
  if (best == nullptr) return {};
  const std::vector<RotorPair> pairs = evidence.Pairs(alpha, best->Merit() - kAsGood);
  double with_best = best->Merit();
  const RotorPair* rival = nullptr;  // of two others
  for (const RotorPair& pair : pairs) {
    if (pair.Has(IdOf(*best))) {
      with_best = std::max(with_best, pair.merit);
    } else if (rival == nullptr || pair.merit > rival->merit) {
      rival = &pair;
    }
  }
  if (rival != nullptr && rival->merit > with_best + kAsGood) {
    const double as_good = rival->merit - kAsGood;
    return {{rival->first, rival->second},
            {InPlaceOf(rival->first, rival->second, pairs, as_good),
             InPlaceOf(rival->second, rival->first, pairs, as_good)},
            rival->merit};
  }
  Ids confused = ConfusedWith(evidence.tested(), *best);
  for (const RotorPair& pair : pairs) {
    if (pair.Has(IdOf(*best)) || pair.merit < with_best - kAsGood) continue;
    confused = United(confused, {IdOf(pair.first), IdOf(pair.second)});
  }
  return {{*best}, {confused}, with_best};
}

}  // namespace trueline
