#include "problems/diagnosis/diagnosis.h"

#include <algorithm>
#include <chrono>

#include "problems/diagnosis/confirm.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/rounds.h"
#include "problems/diagnosis/score_test.h"
#include "problems/diagnosis/verdict.h"

namespace trueline {
namespace {

using Clock = std::chrono::steady_clock;
using Flight = std::unique_ptr<DiagnosedFlight>;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<Cause> CausesFrom(const Rounds& rounds, const DiagnosedFlight& flight) {
  std::vector<Cause> causes;
  const auto fit = flight.Linearise({}, false);
  for (std::size_t i = 0; i < rounds.found.size(); ++i) {
    const Found& f = rounds.found[i];
    const ScoreTest test = TestFound(*fit, rounds.found, i);
    // The value includes an ordinary effect of the same kind, so its usual size adds to the sigma.
    const Eigen::VectorXd sigma =
        (test.sigma.cwiseAbs2() + f.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
    causes.push_back(
        {f.candidate, f.value, sigma, rounds.p[i], rounds.confused[i], Gain(), Gain(), {}, {}});
  }
  return causes;
}

// Bonferroni: the test counts as one more entry of the catalogue.
double FalseDataAlpha(const SearchOptions& options) { return options.alpha / 100.0; }

// The diagnosis of one flight, without the verdict.
class OneFlight {
 public:
  OneFlight(const FlightLog& log, const MakeFlight& make, const SearchOptions& options)
      : options_(options), flight_(make(log)) {
    diagnosis_.warnings = log.warnings;
  }

  Diagnosis Run() {
    Residuals before = flight_->WhitenedResiduals();
    diagnosis_.rms_before = before.rms;  // false data included
    LeaveOutFalseData();
    if (false_data_) before = flight_->WhitenedResiduals();
    const auto false_data_report = flight_->ReportFalseData(false_data_, FalseDataAlpha(options_));
    const std::vector<ReplayError> replays = flight_->ReplayOpenLoop();
    diagnosis_.base_seconds = SecondsSince(start_);
    const Rounds rounds = Search();
    if (false_data_report) diagnosis_.candidates.push_back(*false_data_report);
    diagnosis_.unexplained_by = rounds.goes_with;
    Describe(before, replays, rounds);
    return diagnosis_;
  }

 private:
  // The state at the end of one search.
  struct Outcome {
    Flight flight;
    Rounds rounds;
    std::vector<Cause> causes, set_aside;
    Gain gain, open_loop;

    bool ExplainsAll() const {
      return !rounds.found.empty() && rounds.goes_with.empty() &&
             flight->ExtraordinaryNoise().empty();
    }
  };

  std::vector<Candidate> AllCandidates() const {
    return CandidatesFor(flight_->drive(), flight_->Scope());
  }

  // False data that remain after the catalogue's effects are fitted, provided no term is
  // significant. A strongly rotated camera also displaces all fixes of a pass.
  void LeaveOutFalseData() {
    const double alpha = FalseDataAlpha(options_);
    const auto found = flight_->FindFalseData(alpha);
    if (!found) return;
    const Flight trial = flight_->WithoutCauses();
    const Rounds rounds = SearchCauses(AllCandidates(), options_, trial.get());
    if (!rounds.goes_with.empty() || !trial->FindFalseData(alpha)) return;
    false_data_ = found;
    flight_ = flight_->WithoutFalseData(alpha);
  }

  Outcome SearchAmong(const std::vector<Candidate>& candidates, Flight flight) {
    Outcome outcome{std::move(flight), {}, {}, {}, {}, {}};
    outcome.rounds = SearchCauses(candidates, options_, outcome.flight.get());
    StoreCauses(&outcome);
    if (options_.measure_gain && !outcome.causes.empty()) SetAsideHarmful(&outcome);
    return outcome;
  }

  void StoreCauses(Outcome* outcome) const {
    outcome->causes = CausesFrom(outcome->rounds, *outcome->flight);
    if (false_data_) outcome->causes.insert(outcome->causes.begin(), *false_data_);
  }

  // Sets aside causes that make held-out flight significantly worse: the last one found first. The
  // others are then measured again.
  void SetAsideHarmful(Outcome* outcome) {
    const HeldOutGains gains(*outcome->flight);
    bool false_data = false_data_.has_value();
    while (!outcome->causes.empty()) {
      gains.Measure(*outcome->flight, outcome->rounds.found, &outcome->causes, &outcome->gain,
                    &outcome->open_loop);
      const auto harmful = std::find_if(outcome->causes.rbegin(), outcome->causes.rend(), Harmful);
      if (harmful == outcome->causes.rend()) return;
      const auto worst = harmful.base() - 1;
      outcome->set_aside.push_back(*worst);
      if (false_data && worst == outcome->causes.begin()) {
        outcome->causes.erase(worst);
        false_data = false;
        continue;
      }
      const auto first = outcome->causes.begin() + (false_data ? 1 : 0);
      outcome->rounds.Remove(static_cast<std::size_t>(worst - first));
      outcome->flight->Fit(&outcome->rounds.found);
      const std::vector<Cause> left = CausesFrom(outcome->rounds, *outcome->flight);
      outcome->causes.erase(first, outcome->causes.end());
      outcome->causes.insert(outcome->causes.end(), left.begin(), left.end());
    }
    outcome->gain = outcome->open_loop = Gain();
  }

  // A cause that makes held-out flight worse may have kept a correlated one out of the model.
  // Searches again without such causes and takes that result if nothing is left unexplained. They
  // are left out at all gates and times: with two gates, moving one is equivalent to moving the
  // other.
  Rounds Search() {
    constexpr int kSearches = 3;
    std::vector<Candidate> candidates = AllCandidates();
    Outcome best = SearchAmong(candidates, std::move(flight_));
    diagnosis_.candidates = best.rounds.candidates;
    diagnosis_.set_aside = best.set_aside;
    std::vector<Cause> aside = best.set_aside;
    for (int i = 1; i < kSearches && !aside.empty(); ++i) {
      for (const Cause& cause : aside) {
        std::erase_if(candidates,
                      [&](const Candidate& c) { return c.info == cause.candidate.info; });
      }
      Outcome next = SearchAmong(candidates, best.flight->WithoutCauses());
      aside = next.set_aside;
      if (aside.empty() && next.ExplainsAll()) best = std::move(next);
    }
    flight_ = std::move(best.flight);
    diagnosis_.causes = best.causes;
    diagnosis_.gain = best.gain;
    diagnosis_.open_loop = best.open_loop;
    return best.rounds;
  }

  void Describe(const Residuals& before, const std::vector<ReplayError>& replays,
                const Rounds& rounds) {
    flight_->Describe(&diagnosis_);
    diagnosis_.clusters = flight_->clusters();
    for (const std::string& what : flight_->ExtraordinaryNoise()) {
      diagnosis_.unexplained_by.push_back(what);
    }
    const Residuals after = flight_->WhitenedResiduals();
    for (std::size_t i = 0; i < after.rows.size(); ++i) {
      const Residuals::Row& row = after.rows[i];
      diagnosis_.rows.push_back({row.t, row.kind, row.gate, before.rows[i].sigmas, row.sigmas});
    }
    diagnosis_.rms_after = after.rms;
    diagnosis_.whiteness_p_before = before.whiteness_p;
    diagnosis_.whiteness_p = after.whiteness_p;
    const auto later = rounds.found.empty() ? replays : flight_->ReplayOpenLoop();
    diagnosis_.misfit = std::make_shared<Misfit>(MisfitOf(*flight_, replays, later));
  }

  Clock::time_point start_ = Clock::now();
  const SearchOptions& options_;
  Flight flight_;
  std::optional<Cause> false_data_;
  Diagnosis diagnosis_;
};

}  // namespace

CandidateReport NamedReport(const Candidate& candidate, double z, double p) {
  CandidateReport report{candidate.id(), candidate.Label(), z, p, {}, {}, {}, {}, {}};
  for (const EffectParameterInfo& info : candidate.info->parameters) {
    report.parameters.push_back(info.name);
    report.units.push_back(info.unit);
  }
  return report;
}

Diagnosis Diagnose(const std::vector<FlightLog>& logs, const MakeFlight& make,
                   const SearchOptions& options) {
  const auto start = Clock::now();
  Diagnosis diagnosis = OneFlight(logs.front(), make, options).Run();
  if (!diagnosis.causes.empty()) {
    for (std::size_t i = 1; i < logs.size(); ++i) {
      AddRepeats(logs.front(), make(logs[i]).get(), &diagnosis.causes);
    }
  }
  Confirm(&diagnosis.causes);
  diagnosis.verdict = VerdictOf(diagnosis.causes, diagnosis.set_aside, diagnosis.unexplained_by);
  diagnosis.seconds = SecondsSince(start);
  return diagnosis;
}

}  // namespace trueline
