#include "problems/diagnosis/cause_search.h"

#include <algorithm>

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
    const ScoreTest test = TestFound(*fit, rounds.found, i);
    // The value includes an ordinary effect of the same kind, so its usual size adds to the sigma.
    const Eigen::VectorXd sigma =
        (test.sigma.cwiseAbs2() + f.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
    std::vector<std::string> confused = rounds.confused[i];
    for (std::string& name : ConfusedConstants(*fit, rounds.found, i, constants)) {
      confused.push_back(std::move(name));
    }
    causes.push_back({f.candidate, f.value, sigma, rounds.p[i], confused, Gain(), Gain(), {}, {}});
    causes.back().times_detectable = TimesDetectable(causes.back(), rounds.candidates);
  }
  return causes;
}

bool ExplainsAll(const NamedCauses& search) {
  return !search.rounds.found.empty() && search.rounds.goes_with.empty() &&
         search.flight->ExtraordinaryNoise().empty();
}

class NamedCauseSearch {
 public:
  NamedCauseSearch(const std::optional<Cause>& false_data, const SearchOptions& options,
                   FurtherFlights* others)
      : false_data_(false_data), options_(options), others_(others) {}

  // A cause that is set aside may have kept a correlated one out of the model. Searches again
  // without such causes, at all gates and times: with two gates, moving one is equivalent to moving
  // the other. That result holds if a witness refuted the cause, if nothing is left unexplained, or
  // if it names more.
  NamedCauses Run(Flight flight) {
    constexpr int kSearches = 4;
    std::vector<Candidate> candidates = AllCandidates(*flight);
    NamedCauses best = SearchAmong(candidates, std::move(flight));
    const std::vector<CandidateReport> reports = best.rounds.candidates;
    std::vector<Cause> all_aside = best.set_aside;
    std::vector<Cause> aside = best.set_aside;
    for (int i = 1; i < kSearches; ++i) {
      std::size_t fewer = 0;  // none if a false gate alone is set aside, which is no candidate
      for (const Cause& cause : aside) {
        fewer += std::erase_if(candidates,
                               [&](const Candidate& c) { return c.info == cause.candidate.info; });
      }
      if (fewer == 0) break;
      const bool refuted = std::any_of(aside.begin(), aside.end(), Refuted);
      NamedCauses next = SearchAmong(candidates, best.flight->WithoutCauses());
      aside = next.set_aside;
      const bool explained = aside.empty() && ExplainsAll(next);
      std::erase_if(aside, [](const Cause& c) { return c.candidate.IsFalseGate(); });
      if (!refuted && !explained && !NamesMore(next.causes, best.causes)) continue;
      best = std::move(next);
      all_aside.insert(all_aside.end(), aside.begin(), aside.end());
    }
    best.set_aside = all_aside;
    best.candidates = reports;
    return best;
  }

 private:
  NamedCauses SearchAmong(const std::vector<Candidate>& candidates, Flight flight) {
    NamedCauses outcome;
    outcome.flight = std::move(flight);
    outcome.rounds = SearchCauses(candidates, options_, outcome.flight.get());
    outcome.causes = CausesFrom(outcome.rounds, *outcome.flight);
    if (false_data_) outcome.causes.insert(outcome.causes.begin(), *false_data_);
    JudgeCauses(&outcome);
    return outcome;
  }

  // Sets aside the causes that may not be named (rules.h), one by one: first the one that its
  // witness refutes most, then the last one found. The others are then fitted and judged again.
  void JudgeCauses(NamedCauses* outcome) {
    std::optional<HeldOutGains> gains;
    std::vector<Cause>& causes = outcome->causes;
    bool false_data = false_data_.has_value();
    while (!causes.empty()) {
      AskWitnesses(outcome->flight->data(), outcome->flight->log(), &causes);
      const bool refuted = std::any_of(causes.begin(), causes.end(), Refuted);
      const bool measure = options_.measure_gain && !refuted;
      if (measure) {
        if (!gains) gains.emplace(*outcome->flight);
        gains->Measure(*outcome->flight, outcome->rounds.found, &causes, &outcome->gain,
                       &outcome->open_loop);
      }
      auto worst = FindUnnamed(measure, &causes);
      if (worst == causes.end()) return;
      outcome->set_aside.push_back(*worst);
      if (false_data && worst == causes.begin()) {
        causes.erase(worst);
        false_data = false;
        continue;
      }
      const auto first = causes.begin() + (false_data ? 1 : 0);
      outcome->rounds.Remove(static_cast<std::size_t>(worst - first));
      outcome->flight->Fit(&outcome->rounds.found);
      const std::vector<Cause> left = CausesFrom(outcome->rounds, *outcome->flight);
      causes.erase(first, causes.end());
      causes.insert(causes.end(), left.begin(), left.end());
    }
    outcome->gain = outcome->open_loop = Gain();
  }

  // The next cause that may not be named, with the reason; other flights are asked before a cause
  // is set aside for lack of a gain, and where one is to be named in spite of a loss.
  std::vector<Cause>::iterator FindUnnamed(bool measured, std::vector<Cause>* causes) {
    const auto find = [&] {
      for (Cause& cause : *causes) cause.because = WhyNotNamed(cause, measured);
      const auto refuted = MostRefuted(causes);
      if (refuted != causes->end()) return refuted;
      const auto last = std::find_if(causes->rbegin(), causes->rend(),
                                     [](const Cause& c) { return !c.because.empty(); });
      return last == causes->rend() ? causes->end() : std::prev(last.base());
    };
    const auto unnamed = find();
    const bool a_loss = std::any_of(causes->begin(), causes->end(), [](const Cause& c) {
      return PredictsWorse(c.gain, c.open_loop);
    });
    const bool ask = unnamed == causes->end() ? a_loss : !Refuted(*unnamed);
    if (!ask || !others_->Any()) return unnamed;
    others_->Confirm(causes);
    return find();
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

std::vector<Candidate> AllCandidates(const DiagnosedFlight& flight) {
  return CandidatesFor(flight.drive(), flight.Scope());
}

double TimesDetectable(const Cause& cause, const std::vector<CandidateReport>& reports) {
  double times = 0.0;
  bool reported = false;
  for (const CandidateReport& report : reports) {
    if (report.id != cause.candidate.id() || report.detectable.size() != cause.value.size())
      continue;
    reported = true;
    const Eigen::VectorXd size = cause.value - cause.candidate.Neutral();
    times = std::max(times, size.cwiseQuotient(report.detectable).norm());
  }
  return reported ? times : std::numeric_limits<double>::infinity();
}

}  // namespace trueline
