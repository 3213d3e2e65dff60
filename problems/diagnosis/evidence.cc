#include "problems/diagnosis/evidence.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "problems/diagnosis/steps.h"
#include "problems/diagnosis/thresholds.h"

namespace trueline {
namespace {

// Number of candidates with the same id, including the finer times that refine a step.
int TriedLike(const Candidate& candidate, const std::vector<Candidate>& candidates) {
  const auto count = std::ranges::count(candidates, candidate.info, &Candidate::info);
  return static_cast<int>(count) * (candidate.IsStep() ? kFinerSteps : 1);
}

// Those of the greatest merits: their noise is learned again.
template <class Item, class Merit>
std::vector<Item*> Best(std::vector<Item>* items, Merit merit) {
  std::vector<Item*> best;
  for (Item& item : *items) best.push_back(&item);
  std::ranges::sort(best, std::greater<>(), [&](const Item* i) { return std::invoke(merit, *i); });
  best.resize(std::min(best.size(), kRelearned));
  return best;
}

Eigen::VectorXd OrdinarySteps(const Tested& tested) {
  return tested.columns.Steps(*tested.candidate.info, tested.candidate.Ordinary());
}

void Store(const ScoreTest& test, double gain, Tested* tested) {
  const Candidate& candidate = tested->candidate;
  tested->test = test;
  tested->value = candidate.Neutral() + tested->columns.Sizes(*candidate.info, test.value);
  tested->gain = gain;
  tested->p = std::min(1.0, test.p() * tested->tried);
}

void Test(const Linearisation& fit, const std::vector<int>& beside, Tested* tested) {
  const ScoreTest test = TestColumns(fit, beside, tested->columns.columns, OrdinarySteps(*tested));
  tested->linear_gain = test.gain;
  Store(test, test.gain, tested);
}

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

bool TestedTerm::Exceeds(double alpha, double than) const {
  constexpr double kClearlyBetter = 10.0;  // of merit
  return p < alpha && merit > than + kClearlyBetter;
}

std::vector<const Tested*> FlightEvidence::BestOfEach() const {
  std::map<std::pair<std::string, double>, const Tested*> best;
  for (const Tested& t : tested_) {
    const std::map<std::string, double>& fixed = t.candidate.fixed;
    const double rotor = fixed.count("rotor") > 0 ? fixed.at("rotor") : -1.0;
    const auto [at, added] = best.try_emplace({t.candidate.id(), rotor}, &t);
    if (!added && t.gain > at->second->gain) at->second = &t;
  }
  std::vector<const Tested*> each;
  for (const auto& [name, tested] : best) each.push_back(tested);
  return each;
}

FlightEvidence::FlightEvidence(const DiagnosedFlight& flight,
                               const std::vector<Candidate>& candidates, double alpha)
    : candidates_(candidates), fit_(flight.Linearise(candidates, true)), beside_(fit_->Modelled()) {
  const std::size_t modelled = beside_.size();
  TestEach();
  double merit = 0.0;
  for (const Tested& t : tested_) merit = std::max(merit, t.Merit());
  TestTerms(true, merit, alpha);
  TestTerms(false, merit, alpha);
  if (beside_.size() > modelled) TestEach();
  RelearnBest();
  AddImplausible();
  std::ranges::stable_sort(terms_, std::greater<>(), &TestedTerm::merit);
}

void FlightEvidence::TestEach() {
  tested_.clear();
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    tested_.push_back({candidates_[i], fit_->candidates[i], {}, {}});
    tested_.back().tried = TriedLike(candidates_[i], candidates_);
    Test(*fit_, beside_, &tested_.back());
  }
}

// A significant term of those that are held is a nuisance in all later tests.
void FlightEvidence::TestTerms(bool held, double merit, double alpha) {
  std::vector<int> beside = beside_;
  for (const TermColumns& term : fit_->terms) {
    if (term.held != held) continue;
    const ScoreTest test = TestColumns(*fit_, beside_, term.columns, term.ordinary);
    terms_.push_back({term.name, test.p() * static_cast<double>(fit_->terms.size()),
                      AkaikeMerit(test.gain, term.ordinary.size()), held, term.columns,
                      term.ordinary});
    if (!held || !terms_.back().Exceeds(alpha, merit)) continue;
    beside = Concatenated(std::move(beside), term.columns);
  }
  beside_ = std::move(beside);
}

// The noise was learned without the candidates and contains what they explain, of a drift nearly
// all. The most promising candidates and terms, and all drifts, are judged with noise learned
// again.
void FlightEvidence::RelearnBest() {
  std::vector<Tested*> best = Best(&tested_, &Tested::Merit);
  for (Tested& t : tested_) {
    if (t.candidate.info->drifts && std::ranges::count(best, &t) == 0) best.push_back(&t);
  }
  const std::vector<TestedTerm*> best_terms = Best(&terms_, &TestedTerm::merit);
  std::vector<std::vector<int>> sets;
  for (const Tested* t : best) sets.push_back(t->columns.columns);
  for (const TestedTerm* t : best_terms) sets.push_back(t->columns);
  const std::vector<Linearisation::Relearned> relearned = fit_->Relearn(sets);
  const auto test_again = [&](const Linearisation::Relearned& r, const Eigen::VectorXd& ordinary) {
    ScoreTest test =
        TestColumns(*r.fit, r.fit->Modelled(), r.fit->candidates.front().columns, ordinary);
    test.LimitTo(std::max(0.0, r.gain));
    return test;
  };
  for (std::size_t k = 0; k < relearned.size(); ++k) {
    const Linearisation::Relearned& r = relearned[k];
    if (k < best.size()) {
      Store(test_again(r, OrdinarySteps(*best[k])), r.gain, best[k]);
      continue;
    }
    TestedTerm& term = *best_terms[k - best.size()];
    term.p = test_again(r, term.ordinary).p() * static_cast<double>(fit_->terms.size());
    term.merit = AkaikeMerit(r.gain, term.ordinary.size());
  }
}

// A fitted value that no vehicle has is not named as an effect; the residual stays unexplained.
void FlightEvidence::AddImplausible() {
  const int ids = DistinctIds(candidates_);
  for (const Tested& t : tested_) {
    if (Plausible(t.candidate, t.value)) continue;
    // Every vehicle has some of an ordinary error, and the fit models it.
    if (std::ranges::count(fit_->ordinary, t.candidate.id()) > 0) continue;
    terms_.push_back({t.candidate.id() + ", of a size or sign that no vehicle has",
                      t.p * ids,
                      t.Merit(),
                      false,
                      {}});
  }
}

void FlightEvidence::Exclude(const EffectInfo& info) {
  std::erase_if(tested_, [&](const Tested& t) { return t.candidate.info == &info; });
}

std::vector<TestedPair> FlightEvidence::Pairs(double alpha, double merit) const {
  std::vector<TestedPair> pairs;
  std::vector<const Tested*> each = BestOfEach();
  std::ranges::sort(each);  // as in the catalogue
  for (std::size_t i = 0; i < each.size(); ++i) {
    for (std::size_t j = i + 1; j < each.size(); ++j) {
      TestedPair pair{*each[i], *each[j], 0.0};
      const std::vector<int> both = pair.Columns();
      pair.merit = AkaikeMerit(Estimate(*fit_, beside_, both).gain, std::ssize(both));
      if (pair.merit <= merit) continue;
      Test(*fit_, Concatenated(beside_, each[i]->columns.columns), &pair.second);
      if (!pair.second.Significant(alpha)) continue;
      Test(*fit_, Concatenated(beside_, each[j]->columns.columns), &pair.first);
      if (pair.first.Significant(alpha)) pairs.push_back(std::move(pair));
    }
  }
  RelearnBest(&pairs);
  return pairs;
}

void FlightEvidence::RelearnBest(std::vector<TestedPair>* pairs) const {
  if (pairs->empty()) return;
  const std::vector<TestedPair*> best = Best(pairs, &TestedPair::merit);
  std::vector<std::vector<int>> sets;
  for (const TestedPair* pair : best) sets.push_back(pair->Columns());
  const std::vector<Linearisation::Relearned> relearned = fit_->Relearn(sets);
  for (std::size_t k = 0; k < relearned.size(); ++k) {
    best[k]->merit = AkaikeMerit(relearned[k].gain, std::ssize(sets[k]));
  }
}

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
