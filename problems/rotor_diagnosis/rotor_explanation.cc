#include "problems/rotor_diagnosis/rotor_explanation.h"

#include <algorithm>
#include <set>
#include <utility>

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

// Of the significant effects that fit as well as the best, the one with the fewest parameters.
const RotorTested* Simplest(const std::vector<RotorTested>& tested, double alpha, double merit) {
  const RotorTested* simplest = nullptr;
  for (const RotorTested& t : tested) {
    if (t.p >= alpha || t.Merit() < merit - kAsGood || !Plausible(t.candidate, t.value)) continue;
    if (simplest == nullptr || std::make_pair(-t.value.size(), t.Merit()) >
                                   std::make_pair(-simplest->value.size(), simplest->Merit())) {
      simplest = &t;
    }
  }
  return simplest;
}

// Effects that could replace one of a pair while the other is kept.
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
  const RotorTested* greatest = Best(evidence.tested(), alpha);
  if (greatest == nullptr) return {};
  double with_best = greatest->Merit();
  const RotorTested* best = Simplest(evidence.tested(), alpha, with_best);
  const std::vector<RotorPair> pairs = evidence.Pairs(alpha, with_best - kAsGood);
  const RotorPair* rival = nullptr;  // the best pair without `best`
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
