#include "problems/diagnosis/evidence.h"

#include <algorithm>
#include <map>
#include <utility>

#include "problems/diagnosis/steps.h"
#include "problems/diagnosis/thresholds.h"

namespace trueline {
namespace {

// Number of candidates with the same id, including the finer times that refine a step.
int TriedLike(const Candidate& candidate, const std::vector<Candidate>& candidates) {
  const auto count = std::count_if(candidates.begin(), candidates.end(),
                                   [&](const Candidate& c) { return c.info == candidate.info; });
  return static_cast<int>(count) * (candidate.IsStep() ? kFinerSteps : 1);
}

// Indices of the greatest merits, at most `count`.
template <class Items, class Merit>
std::vector<std::size_t> GreatestMerits(const Items& items, std::size_t count, const Merit& merit) {
  std::vector<std::size_t> order(items.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return merit(items[a]) > merit(items[b]); });
  order.resize(std::min(order.size(), count));
  return order;
}

}  // namespace

bool TestedTerm::Exceeds(double alpha, double than) const {
  constexpr double kClearlyBetter = 10.0;  // of merit
  return p < alpha && merit > than + kClearlyBetter;
}

std::vector<std::size_t> BestOfEach(const std::vector<Tested>& tested) {
  std::map<std::pair<std::string, double>, std::size_t> best;
  for (std::size_t i = 0; i < tested.size(); ++i) {
    const std::map<std::string, double>& fixed = tested[i].candidate.fixed;
    const double rotor = fixed.count("rotor") > 0 ? fixed.at("rotor") : -1.0;
    const auto [at, added] = best.try_emplace({tested[i].candidate.id(), rotor}, i);
    if (!added && tested[i].gain > tested[at->second].gain) at->second = i;
  }
  std::vector<std::size_t> indices;
  indices.reserve(best.size());
  for (const auto& [name, index] : best) indices.push_back(index);
  return indices;
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
  std::stable_sort(terms_.begin(), terms_.end(),
                   [](const TestedTerm& a, const TestedTerm& b) { return a.merit > b.merit; });
}

Eigen::VectorXd FlightEvidence::OrdinarySteps(std::size_t which) const {
  const Candidate& candidate = candidates_[which];
  return fit_->candidates[which].Steps(*candidate.info, candidate.Ordinary());
}

void FlightEvidence::Store(const ScoreTest& test, double gain, Tested* tested) const {
  const Candidate& candidate = tested->candidate;
  tested->test = test;
  tested->value = candidate.Neutral() + tested->columns.Sizes(*candidate.info, test.value);
  tested->gain = gain;
  tested->p = std::min(1.0, test.p() * tested->tried);
}

Tested FlightEvidence::TestOne(std::size_t which, const std::vector<int>& beside) const {
  Tested tested{candidates_[which], fit_->candidates[which], {}, {}};
  tested.tried = TriedLike(tested.candidate, candidates_);
  const ScoreTest test = TestColumns(*fit_, beside, tested.columns.columns, OrdinarySteps(which));
  tested.linear_gain = test.gain;
  Store(test, test.gain, &tested);
  return tested;
}

void FlightEvidence::TestEach() {
  tested_.clear();
  for (std::size_t i = 0; i < candidates_.size(); ++i) tested_.push_back(TestOne(i, beside_));
}

// A significant term of those that are held is a nuisance in all later tests.
void FlightEvidence::TestTerms(bool held, double merit, double alpha) {
  std::vector<int> beside = beside_;
  for (const TermColumns& term : fit_->terms) {
    if (term.held != held) continue;
    const ScoreTest test = TestColumns(*fit_, beside_, term.columns, term.ordinary);
    terms_.push_back({term.name, test.p() * static_cast<double>(fit_->terms.size()),
                      AkaikeMerit(test.gain, term.ordinary.size()), held, term.columns});
    if (!held || !terms_.back().Exceeds(alpha, merit)) continue;
    beside = Concatenated(std::move(beside), term.columns);
  }
  beside_ = std::move(beside);
}

// The noise was learned without the candidates and contains what they explain, of a drift nearly
// all. The most promising candidates and terms, and all drifts, are judged with noise learned
// again.
void FlightEvidence::RelearnBest() {
  auto best = GreatestMerits(tested_, kRelearned, [](const Tested& t) { return t.Merit(); });
  for (std::size_t i = 0; i < tested_.size(); ++i) {
    const bool chosen = std::count(best.begin(), best.end(), i) > 0;
    if (tested_[i].candidate.info->drifts && !chosen) best.push_back(i);
  }
  const auto best_terms =
      GreatestMerits(terms_, kRelearned, [](const TestedTerm& t) { return t.merit; });
  std::vector<std::vector<int>> sets;
  sets.reserve(best.size() + best_terms.size());
  for (const std::size_t i : best) sets.push_back(tested_[i].columns.columns);
  for (const std::size_t i : best_terms) sets.push_back(terms_[i].columns);
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
      Store(test_again(r, OrdinarySteps(best[k])), r.gain, &tested_[best[k]]);
      continue;
    }
    TestedTerm& term = terms_[best_terms[k - best.size()]];
    const auto same = std::find_if(fit_->terms.begin(), fit_->terms.end(),
                                   [&](const TermColumns& t) { return t.columns == term.columns; });
    term.p = test_again(r, same->ordinary).p() * static_cast<double>(fit_->terms.size());
    term.merit = AkaikeMerit(r.gain, same->ordinary.size());
  }
}

// A fitted value that no vehicle has is not named as an effect; the residual stays unexplained.
void FlightEvidence::AddImplausible() {
  const int ids = DistinctIds(candidates_);
  for (const Tested& t : tested_) {
    if (Plausible(t.candidate, t.value)) continue;
    // Every vehicle has some of an ordinary error, and the fit models it.
    if (std::count(fit_->ordinary.begin(), fit_->ordinary.end(), t.candidate.id()) > 0) continue;
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
  const std::vector<std::size_t> distinct = BestOfEach(tested_);
  for (const std::size_t i : distinct) {
    const std::vector<int>& first = tested_[i].columns.columns;
    for (const std::size_t j : distinct) {
      if (j <= i) continue;
      const std::vector<int>& second = tested_[j].columns.columns;
      const double joint = AkaikeMerit(Estimate(*fit_, beside_, Concatenated(first, second)).gain,
                                       static_cast<Eigen::Index>(first.size() + second.size()));
      if (joint <= merit) continue;
      TestedPair pair{tested_[i], TestOne(j, Concatenated(beside_, first)), joint};
      if (!pair.second.Significant(alpha)) continue;
      pair.first = TestOne(i, Concatenated(beside_, second));
      if (pair.first.Significant(alpha)) pairs.push_back(std::move(pair));
    }
  }
  RelearnBest(&pairs);
  return pairs;
}

void FlightEvidence::RelearnBest(std::vector<TestedPair>* pairs) const {
  if (pairs->empty()) return;
  const auto best =
      GreatestMerits(*pairs, kRelearned, [](const TestedPair& pair) { return pair.merit; });
  std::vector<std::vector<int>> sets;
  sets.reserve(best.size());
  for (const std::size_t i : best) sets.push_back((*pairs)[i].Columns());
  const std::vector<Linearisation::Relearned> relearned = fit_->Relearn(sets);
  for (std::size_t k = 0; k < relearned.size(); ++k) {
    (*pairs)[best[k]].merit =
        AkaikeMerit(relearned[k].gain, static_cast<Eigen::Index>(sets[k].size()));
  }
}

}  // namespace trueline
