#include "problems/diagnosis/rounds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "problems/diagnosis/evidence_sum.h"
#include "problems/diagnosis/rules.h"
#include "problems/diagnosis/steps.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/diagnosis/witness.h"
#include "problems/result/statistics.h"

namespace trueline {

bool RetainsHalf(const Found& f, const ScoreTest& test) {
  return ShareLeft(test.value, f.value - f.candidate.Neutral(), test.sigma) > kMostOf;
}

namespace {

constexpr std::size_t kMostCauses = 4;

CandidateReport Report(const Tested& t, double alpha) {
  const EffectInfo& info = *t.candidate.info;
  return {t.candidate.id(),
          t.candidate.Label(),
          t.test.z(),
          t.p,
          t.value,
          t.columns.Sizes(info, t.test.sigma),
          t.columns.Sizes(info, DetectableSize(t.test, alpha / t.tried))};
}

// True if the vehicle's motion clearly differs from that of every effect. An effect of an
// impossible size does not count: it may be significant only because a correlated effect is missing
// from the model, and such effects are searched first.
bool BeyondEffects(const std::vector<TestedTerm>& remaining) {
  return std::ranges::any_of(remaining,
                             [](const TestedTerm& t) { return !t.held && !t.columns.empty(); });
}

class CauseSearch {
 public:
  CauseSearch(const std::vector<Candidate>& candidates, const SearchOptions& options,
              DiagnosedFlight* flight)
      : options_(options),
        flight_(flight),
        candidates_(candidates),
        tried_(std::max(1, DistinctIds(candidates))),
        alpha_(options.alpha / tried_) {}

  Rounds Run() {
    for (std::size_t round = 0; round <= kMostCauses; ++round) {
      const Outcome outcome = TestAll();
      const Explanation& best = outcome.best;
      const std::vector<TestedTerm>& remaining = outcome.remaining;
      if (round == 0) StoreFirst(outcome.evidence);
      rounds_.remaining = remaining;
      rounds_.impossible.clear();
      for (const Tested* t : outcome.evidence->BestOfEach()) {
        if (t->p < alpha_ && !Plausible(t->candidate, t->value)) {
          rounds_.impossible.push_back(t->candidate);
        }
      }
      if (!outcome.witnessed.empty() && !IsFull()) {
        Add(outcome.witnessed);
        continue;
      }
      const bool last = best.effects.empty() || round == kMostCauses || IsFull();
      const bool beyond = BeyondEffects(remaining);
      if (!last && (!beyond || AddOnTrial(best.effects))) {
        if (!beyond) Add(best.effects);
        continue;
      }
      if (AddMisjudged(outcome)) continue;
      if (beyond) DropApproximations(outcome);
      break;
    }
    return rounds_;
  }

 private:
  // What was done about a candidate.
  struct Known {
    bool asked = false;                // its witness, since the flight speaks for it
    bool seen = false;                 // the same, whatever the flight says
    bool fitted = false;               // as misjudged
    bool possible = false;             // its size, by its witness
    double beside_flight = -INFINITY;  // what its witness shows
  };
  // All tests of the model as it is.
  struct Outcome {
    std::shared_ptr<FlightEvidence> evidence;
    Explanation best;
    std::vector<TestedTerm> remaining;
    std::vector<Tested> witnessed;  // that flight and witness show together
  };

  bool IsFull() const { return rounds_.found.size() >= kMostCauses; }

  Outcome TestAll() {
    if (next_) return *std::exchange(next_, std::nullopt);
    Outcome outcome;
    outcome.evidence = std::make_shared<FlightEvidence>(
        *flight_, WithRefinedSteps(Without(candidates_, rounds_.found), *flight_), options_.alpha);
    outcome.witnessed = AskFirst(outcome.evidence.get());
    outcome.best = Explain(*outcome.evidence, alpha_);
    outcome.remaining = RemainingTerms(*outcome.evidence, options_.alpha, outcome.best.merit);
    return outcome;
  }

  void StoreFirst(const std::shared_ptr<const FlightEvidence>& evidence) {
    FirstRound& first = rounds_.first;
    first.tests = evidence;
    for (const Tested& t : evidence->tested()) first.candidates.push_back(Report(t, alpha_));
    for (const Tested* t : evidence->BestOfEach()) {
      Cause cause = CauseOf(*t);
      cause.evidence.prior = PriorEvidenceOf(cause.candidate.id(), first.candidates);
      if (WhyNotNamed(cause, options_.alpha).empty()) first.shown.push_back(std::move(cause));
    }
  }

  // The effect as a cause, with what its witness says of it beside the causes in the model.
  Cause Asked(const Tested& t) const {
    std::vector<Cause> asked;
    for (const Found& f : rounds_.found) asked.push_back({f.candidate, f.value, 0.0 * f.value});
    asked.push_back(CauseOf(t));
    asked.back().evidence.prior = -std::log(static_cast<double>(tried_ * t.tried));
    AskWitnesses(flight_->data(), flight_->log(), flight_->Path(), &asked);
    return asked.back();
  }

  // What a witness says is known before a fit: an effect that it excludes is not tried, and one
  // that it shows is not argued away by another that fits better. Each effect that the flight
  // speaks for is asked for once. Returns those that flight and witness show together. The flight
  // misjudges a large effect: where it states an impossible size, its witness may show a possible
  // one.
  std::vector<Tested> AskFirst(FlightEvidence* evidence) {
    std::vector<Tested> asked, witnessed;
    for (const Tested* t : evidence->BestOfEach()) {
      const bool speaks = t->Significant(alpha_) || CauseOf(*t).evidence.flight > 0.0;
      if (speaks && !std::exchange(known_[t->candidate.Label()].asked, true)) asked.push_back(*t);
    }
    for (const Tested& t : asked) {
      Cause cause = Asked(t);
      AddOthersEvidence(options_, &cause);
      const EffectInfo* info = t.candidate.info;
      const bool plausible = Plausible(t.candidate, t.value);
      const bool shows = cause.witness.says == "confirms";
      const bool possible = shows && Plausible(t.candidate, cause.witness.value);
      if (plausible && Refuted(cause, options_.alpha)) {
        evidence->Exclude(*info);
        std::erase_if(candidates_, [&](const Candidate& c) { return c.info == info; });
        rounds_.refuted.push_back(cause);
      } else if (shows && (plausible || possible) && WhyNotNamed(cause, options_.alpha).empty()) {
        Known& known = known_[t.candidate.Label()];
        known.beside_flight = cause.evidence.Total() - cause.evidence.flight;
        known.possible = known.possible || possible;
        witnessed.push_back(t);
      }
    }
    return witnessed;
  }

  // True if a cause in the model, judged by `test`, is shown by the flight, or by the flight
  // together with its witness.
  bool IsShown(const Found& f, const ScoreTest& test) {
    if (test.p() < alpha_) return true;
    return FlightEvidenceOf(test, PriorSizes(*f.candidate.info)) +
               known_[f.candidate.Label()].beside_flight >=
           EvidenceNeeded(options_.alpha);
  }

  // An effect that acts through a constant (a wind through drag) or by its square is misjudged
  // where the constant is wrong without it: its linear estimate is impossible, or its scores
  // scatter. The likeliest such effects are fitted together with the constants and then judged.
  bool AddMisjudged(const Outcome& outcome) {
    constexpr double kFirstSize = 0.5;  // of the largest plausible
    const FlightEvidence& evidence = *outcome.evidence;
    const double remaining = StrongestOf(outcome.remaining);
    if (IsFull()) return false;
    std::vector<Tested> likely;
    for (const Tested* each : evidence.BestOfEach()) {
      const Tested& t = *each;
      const double dof = static_cast<double>(t.value.size());
      const bool shown = t.LinearMerit() >= kSmallPart * remaining &&
                         EvidenceOfChance(ChiSquareTail(t.linear_gain, dof) * tried_ * t.tried) >=
                             EvidenceNeeded(options_.alpha);
      if (shown && !std::exchange(known_[t.candidate.Label()].fitted, true)) likely.push_back(t);
    }
    std::ranges::sort(likely, std::greater<>(), &Tested::LinearMerit);
    likely.resize(std::min(likely.size(), kTriedByFit));
    for (Tested& t : likely) {
      const Eigen::VectorXd most = kFirstSize * t.candidate.EachOf(&EffectParameterInfo::plausible);
      t.value = t.value.cwiseMin(most).cwiseMax(-most);
    }
    if (const auto shown = ShownByWitness(evidence)) likely.push_back(*shown);
    return std::ranges::any_of(
        likely, [&](const Tested& t) { return AddOnTrial({t}, rounds_.found.size() + 1); });
  }

  // An error of the attitude that its witness shows beside the causes in the model, with the size
  // that it shows; the surest one. A flight whose constants imitate it has no word of it.
  std::optional<Tested> ShownByWitness(const FlightEvidence& evidence) {
    std::optional<Tested> surest;
    double most = EvidenceNeeded(options_.alpha);
    for (const Tested* t : evidence.BestOfEach()) {
      if (t->candidate.info->enters != EntersAt::kAttitude) continue;
      Known& known = known_[t->candidate.Label()];
      if (std::exchange(known.seen, true)) continue;
      const Cause cause = Asked(*t);
      const double shown = WitnessAlone(cause) + cause.evidence.prior;
      if (shown < most) continue;
      most = known.beside_flight = shown;
      surest = *t;
      surest->value = cause.witness.value;
    }
    return surest;
  }

  // Adds causes to the model and drops those that they explain away, unless fewer than
  // `at_least` are left: the caller then withdraws them all.
  void Add(const std::vector<Tested>& effects, std::size_t at_least = 0) {
    for (const Tested& effect : effects) {
      rounds_.found.push_back(Refined(effect, *flight_));
      rounds_.found.back().p = std::min(1.0, effect.p * tried_);
      rounds_.found.back().confused = effect.confused;
    }
    flight_->Fit(&rounds_.found);
    while (DropExplainedAway() && rounds_.found.size() >= at_least) flight_->Fit(&rounds_.found);
  }

  // Drops the last cause that is no longer significant given the others, or no longer plausible,
  // and excludes it from later rounds. True if one was dropped.
  bool DropExplainedAway() {
    const auto fit = flight_->Linearise({}, false);
    for (std::size_t i = rounds_.found.size(); i-- > 0;) {
      const Found& f = rounds_.found[i];
      const bool plausible =
          (Plausible(f.candidate, f.value) || known_[f.candidate.Label()].possible) &&
          flight_->ConstantsArePhysical(f);
      if (plausible && IsShown(f, TestFound(*fit, rounds_.found, i))) continue;
      candidates_ = Without(candidates_, {f});
      EraseAt(i, &rounds_.found);
      return true;
    }
    return false;
  }

  // An effect that is linearised far from its value may appear weaker than a term that only
  // approximates it. Adds the best effects on trial. If such a term remains significant after the
  // fit, they stay only if none of the causes approximates it.
  // `at_least`: causes that must then be in the model.
  bool AddOnTrial(const std::vector<Tested>& effects, std::size_t at_least = 0) {
    const Rounds before = rounds_;
    const std::vector<Candidate> candidates_before = candidates_;
    Add(effects, at_least);
    if (rounds_.found.size() >= at_least) {
      next_ = TestAll();
      if (!BeyondEffects(next_->remaining) || Approximations(*next_).empty()) return true;
      next_.reset();
    }
    rounds_ = before;
    candidates_ = candidates_before;
    flight_->Fit(&rounds_.found);
    return false;
  }

  // Causes that the remaining terms explain away, wholly or by more than half; the last one first.
  std::vector<std::size_t> Approximations(const Outcome& outcome) {
    std::vector<int> beside;
    for (const TestedTerm& t : outcome.remaining) {
      beside = Concatenated(std::move(beside), t.columns);
    }
    std::vector<std::size_t> approximations;
    for (std::size_t i = rounds_.found.size(); i-- > 0;) {
      const ScoreTest test = TestFound(outcome.evidence->fit(), rounds_.found, i, beside);
      if (!IsShown(rounds_.found[i], test) || !RetainsHalf(rounds_.found[i], test)) {
        approximations.push_back(i);
      }
    }
    return approximations;
  }

  void DropApproximations(const Outcome& outcome) {
    const std::vector<std::size_t> approximations = Approximations(outcome);
    for (const std::size_t i : approximations) EraseAt(i, &rounds_.found);
    if (!approximations.empty()) flight_->Fit(&rounds_.found);
  }

  const SearchOptions& options_;
  DiagnosedFlight* flight_;
  std::vector<Candidate> candidates_;
  std::map<std::string, Known> known_;  // by label
  int tried_;                           // effects
  double alpha_;                        // of one of them
  Rounds rounds_;
  std::optional<Outcome> next_;  // of the next round, where a trial has tested all already
};

}  // namespace

Rounds SearchCauses(const std::vector<Candidate>& candidates, const SearchOptions& options,
                    DiagnosedFlight* flight) {
  return CauseSearch(candidates, options, flight).Run();
}

void WidenDetectable(const FlightEvidence& tests, double unstated, double alpha,
                     std::vector<CandidateReport>* reports) {
  if (unstated == 0.0) return;
  const Linearisation& fit = tests.fit();
  for (std::size_t i = 0; i < tests.tested().size(); ++i) {
    const Tested& t = tests.tested()[i];
    ScoreTest test = t.test;
    test.Scale(t.columns.unit);
    const UnstatedErrors errors =
        UnstatedErrorsOf(fit, t.candidate, t.columns, fit.Modelled(), tests.candidates(), unstated);
    const Eigen::VectorXd size = DetectableSize(test, alpha / t.tried, errors);
    (*reports)[i].detectable = (*reports)[i].detectable.cwiseMax(size);
  }
}

double StrongestOf(const std::vector<TestedTerm>& terms) {
  double merit = 0.0;
  for (const TestedTerm& t : terms) merit = std::max(merit, t.merit);
  return merit;
}

std::vector<TestedTerm> RemainingTerms(const FlightEvidence& evidence, double alpha, double merit) {
  std::vector<TestedTerm> remaining;
  for (const TestedTerm& term : evidence.terms()) {
    if (term.Exceeds(alpha, term.held ? 0.0 : merit)) remaining.push_back(term);
  }
  return remaining;
}

}  // namespace trueline
