#include "problems/diagnosis/cause_search.h"

#include <algorithm>

#include "problems/diagnosis/evidence_sum.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/rules.h"
#include "problems/diagnosis/score_test.h"
#include "problems/diagnosis/witness.h"

namespace trueline {
namespace {

using Flight = std::unique_ptr<DiagnosedFlight>;

std::vector<Cause> CausesFrom(const Rounds& rounds, const DiagnosedFlight& flight) {
  std::vector<Cause> causes;
  const auto fit = flight.Linearise({}, false);
  const std::vector<std::string> constants = flight.Constants();
  for (std::size_t i = 0; i < rounds.found.size(); ++i) {
    const Found& f = rounds.found[i];
    ScoreTest test = TestFound(*fit, rounds.found, i);
    const std::vector<int>& answers = fit->found[i].answers;
    if (!answers.empty()) test.Widen(TestFound(*fit, rounds.found, i, answers));
    // The value includes an ordinary effect of the same kind, so its usual size adds to the sigma.
    const Eigen::VectorXd sigma =
        (test.sigma.cwiseAbs2() + f.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
    std::vector<std::string> confused = f.confused;
    const auto more = ConfusedConstants(*fit, rounds.found, i, constants);
    confused.insert(confused.end(), more.begin(), more.end());
    causes.push_back({f.candidate, f.value, sigma, f.p, confused});
    causes.back().evidence.flight = FlightEvidenceOf(test, PriorSizes(*f.candidate.info));
    causes.back().evidence.prior = PriorEvidenceOf(f.candidate.id(), rounds.first.candidates);
  }
  return causes;
}

double TotalOf(const std::vector<Cause>& causes) {
  double total = 0.0;
  for (const Cause& cause : causes) total += cause.evidence.Total();
  return total;
}

bool Lists(const std::vector<Cause>& causes, const std::string& id) {
  return std::ranges::any_of(causes, [&](const Cause& c) { return c.candidate.id() == id; });
}

class NamedCauseSearch {
 public:
  NamedCauseSearch(const std::optional<Cause>& false_data, const SearchOptions& options,
                   FurtherFlights* others)
      : false_data_(false_data), options_(options), others_(others) {}

  // A cause that is set aside may have kept a correlated one out of the model. Searches again
  // without such causes, at all gates and times; what names more by the sum of its evidence counts.
  NamedCauses Run(Flight flight) {
    std::vector<Candidate> candidates = flight->AllCandidates();
    NamedCauses best = SearchAmong(candidates, std::move(flight));
    const FirstRound first = best.rounds.first;
    std::vector<Cause> aside = best.set_aside;
    std::size_t fewer = 0;  // none if a false gate alone is set aside, which is no candidate
    for (const Cause& cause : aside) {
      fewer += std::erase_if(candidates,
                             [&](const Candidate& c) { return c.info == cause.candidate.info; });
    }
    if (fewer > 0) {
      NamedCauses next = SearchAmong(candidates, best.flight->WithoutCauses());
      std::ranges::copy_if(next.set_aside, std::back_inserter(aside),
                           [](const Cause& c) { return !c.candidate.IsFalseGate(); });
      if (TotalOf(next.causes) > TotalOf(best.causes)) {
        best = std::move(next);
        best.set_aside = aside;
      }
    }
    best.rounds.first = first;
    best.explained = Explained(first.shown, best);
    return best;
  }

 private:
  NamedCauses SearchAmong(const std::vector<Candidate>& candidates, Flight flight) {
    NamedCauses outcome;
    outcome.flight = std::move(flight);
    outcome.rounds = SearchCauses(candidates, options_, outcome.flight.get());
    outcome.set_aside = outcome.rounds.refuted;
    for (Cause& cause : outcome.set_aside) cause.because = WhyNotNamed(cause, options_.alpha);
    outcome.causes = CausesFrom(outcome.rounds, *outcome.flight);
    if (false_data_) outcome.causes.insert(outcome.causes.begin(), *false_data_);
    do {
      JudgeCauses(&outcome);
    } while (options_.measure_gain && LacksGain(&outcome));
    return outcome;
  }

  // Measures what the causes are worth on held-out flight. True if it sets one aside, which
  // predicts that flight worse.
  bool LacksGain(NamedCauses* outcome) {
    outcome->gains = {};
    if (outcome->causes.empty()) return false;
    outcome->gains = MeasureGains(*outcome->flight, outcome->rounds.found, &outcome->causes);
    for (Cause& cause : outcome->causes) {
      cause.evidence.held_out = HeldOutEvidence(cause.gains);
      cause.because = WhyNotNamed(cause, options_.alpha);
    }
    return SetLeastAside(outcome);
  }

  // Sets aside the causes whose evidence does not suffice, the least first. The others are then
  // fitted and judged again.
  void JudgeCauses(NamedCauses* outcome) {
    std::vector<Cause>& causes = outcome->causes;
    while (!causes.empty()) {
      AskWitnesses(outcome->flight->data(), outcome->flight->log(), outcome->flight->Path(),
                   &causes);
      if (others_->Any()) others_->Confirm(&causes);
      for (Cause& cause : causes) {
        AddOthersEvidence(options_, &cause);
        cause.because = WhyNotNamed(cause, options_.alpha);
      }
      if (!SetLeastAside(outcome)) return;
    }
  }

  // Sets the cause of the least evidence aside, if it lacks any, and fits the others again.
  static bool SetLeastAside(NamedCauses* outcome) {
    std::vector<Cause>& causes = outcome->causes;
    const auto least = std::ranges::min_element(
        causes, {}, [](const Cause& cause) { return cause.evidence.Total(); });
    if (least == causes.end() || least->because.empty()) return false;
    outcome->set_aside.push_back(*least);
    const auto first = causes.end() - static_cast<long>(outcome->rounds.found.size());
    if (least < first) {  // false data, which are not in the fit
      causes.erase(least);
      return true;
    }
    EraseAt(static_cast<std::size_t>(least - first), &outcome->rounds.found);
    outcome->flight->Fit(&outcome->rounds.found);
    const std::vector<Cause> left = CausesFrom(outcome->rounds, *outcome->flight);
    causes.erase(first, causes.end());
    causes.insert(causes.end(), left.begin(), left.end());
    return true;
  }

  // Effects that were significant alone, and are neither named nor set aside.
  static std::vector<Cause> Explained(const std::vector<Cause>& first, const NamedCauses& search) {
    std::vector<Cause> explained;
    for (const Cause& cause : first) {
      const std::string& id = cause.candidate.id();
      if (Lists(search.causes, id) || Lists(search.set_aside, id)) continue;
      explained.push_back(cause);
      explained.back().because =
          !Plausible(cause.candidate, cause.value) ? "no vehicle has one of this size or sign"
          : search.causes.empty() ? "fitted together with the constants it explains little"
                                  : "beside the named causes little of it is left";
    }
    return explained;
  }

  const std::optional<Cause>& false_data_;
  const SearchOptions& options_;
  FurtherFlights* others_;
};

}  // namespace

NamedCauses SearchNamedCauses(Flight flight, const std::optional<Cause>& false_data,
                              const SearchOptions& options, FurtherFlights* others) {
  return NamedCauseSearch(false_data, options, others).Run(std::move(flight));
}

}  // namespace trueline
