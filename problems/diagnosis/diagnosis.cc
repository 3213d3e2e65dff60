#include "problems/diagnosis/diagnosis.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "problems/diagnosis/cause_rounds.h"
#include "problems/diagnosis/choose.h"
#include "problems/diagnosis/confirm.h"
#include "problems/diagnosis/false_gate.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/prepare_log.h"
#include "problems/diagnosis/residual_rows.h"
#include "problems/diagnosis/verdict.h"
#include "problems/result/distributions.h"

namespace trueline {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void StoreCauses(const CauseSearch& search, const Rounds& rounds, Diagnosis* diagnosis) {
  for (std::size_t i = 0; i < rounds.found.size(); ++i) {
    const Found& f = rounds.found[i];
    const ScoreTest test = search.TestFound(rounds.found, i);
    // The value includes an ordinary effect of the same kind, so its usual size adds to the sigma.
    const Eigen::VectorXd sigma =
        (test.sigma.cwiseAbs2() + f.candidate.Ordinary().cwiseAbs2()).cwiseSqrt();
    diagnosis->causes.push_back(
        {f.candidate, f.value, sigma, rounds.p[i], rounds.confused[i], Gain(), Gain(), {}, {}});
  }
}

void StoreModel(const CauseSearch& search, Diagnosis* diagnosis) {
  const ThetaVector value = search.Parameters(), sigma = search.Sigmas();
  for (int i = 0; i < kThetaSize; ++i) {
    diagnosis->parameters.push_back({kTheta[i].name, kTheta[i].unit, value[i], sigma[i]});
  }
  diagnosis->noise = search.fit().noise;
  diagnosis->clusters = search.plan().clusters;
}

Cause CauseOf(const FalseGate& found) {
  Candidate candidate{&InfoOf("false_gate"),
                      {{"gate", found.gate},
                       {"dx", found.offset.x()},
                       {"dy", found.offset.y()},
                       {"dz", found.offset.z()}}};
  Cause cause{candidate, {}, {}, found.p, {}, Gain(), Gain(), {}, {}};
  cause.value = Eigen::VectorXd::Constant(1, found.fraction);
  cause.sigma = Eigen::VectorXd::Constant(1, found.sigma);
  return cause;
}

// `search` must have been fitted without the fixes of `found`.
CandidateReport ReportOf(const std::optional<FalseGate>& found, double alpha, CauseSearch* search) {
  const double p = found ? found->p : 1.0;
  CandidateReport report = NamedReport({&InfoOf("false_gate"), {}},
                                       std::sqrt(ChiSquareCritical(std::max(p, 1e-300), 1.0)), p);
  report.value = Eigen::VectorXd::Constant(1, found ? found->fraction : 0.0);
  report.sigma = Eigen::VectorXd::Constant(1, found ? found->sigma : 0.0);
  report.detectable =
      Eigen::VectorXd::Constant(1, DetectableFraction(search->flight(), search->fit(), alpha));
  return report;
}

bool HasGates(const FlightLog& log) {
  return std::any_of(log.fixes.begin(), log.fixes.end(), [](const Fix& f) { return f.gate >= 0; });
}

// A search with the base fit solved.
std::unique_ptr<CauseSearch> FittedSearch(const FlightLog& data, const DiagnosisOptions& options) {
  auto search = std::make_unique<CauseSearch>(data, OpenPriors(options.vgd));
  std::vector<Found> none;
  search->Fit(&none, 0);
  return search;
}

// Bonferroni: the test counts as one more entry of the catalogue.
double FalseGateAlpha(const DiagnosisOptions& options) { return options.alpha / 100.0; }

// A false gate that remains after the catalogue's effects are fitted, provided no library term is
// significant. A strongly rotated camera also displaces all fixes of a pass.
std::optional<FalseGate> FalseGateBeyondEffects(const FlightLog& data,
                                                const DiagnosisOptions& options,
                                                CauseSearch* search) {
  const double alpha = FalseGateAlpha(options);
  auto found = FindFalseGate(search->flight(), search->fit(), alpha);
  if (!found) return std::nullopt;
  const auto trial = FittedSearch(data, options);
  const Rounds rounds =
      SearchCauses(CandidatesFor(data, ScopeOf(data, options)), options, trial.get());
  if (!rounds.goes_with.empty()) return std::nullopt;  // unexplained motion: no false gate
  return FindFalseGate(trial->flight(), trial->fit(), alpha) ? found : std::nullopt;
}

// Removes causes that make held-out arcs significantly worse: the last one found first. The others
// are then measured again.
void DropHarmful(const FlightLog& data, const GainLogs& logs, const DiagnosisOptions& options,
                 CauseSearch* search, Rounds* rounds, Diagnosis* diagnosis) {
  if (diagnosis->causes.empty()) return;
  const auto spare = FittedSearch(data, options);
  // All models are compared under one process noise, the one learned without causes, so that only
  // the models differ. A larger one would let windows forget their past and hide model errors on an
  // arc.
  DiagnosisOptions measured = options;
  measured.vgd.process = spare->fit().noise.process;
  const HeldOutErrors bare = ErrorsOf(FitHalves(logs.recorded, *spare, {}), *spare, measured.vgd);
  while (!diagnosis->causes.empty()) {
    MeasureGains(logs, measured, rounds->found, *search, bare, spare.get(), diagnosis);
    const auto harmful = std::find_if(diagnosis->causes.rbegin(), diagnosis->causes.rend(),
                                      [](const Cause& c) { return Harmful(c); });
    if (harmful == diagnosis->causes.rend()) return;
    const auto worst = harmful.base() - 1;
    diagnosis->set_aside.push_back(*worst);
    if (worst->candidate.info->id == "false_gate") {
      diagnosis->causes.erase(worst);
      continue;
    }
    const auto before_found = diagnosis->causes.size() - rounds->found.size();
    rounds->Remove(static_cast<std::size_t>(worst - diagnosis->causes.begin()) - before_found);
    Refit(search, &rounds->found);
    diagnosis->causes.resize(before_found);
    StoreCauses(*search, *rounds, diagnosis);
  }
  diagnosis->gain = diagnosis->open_loop = Gain();
}

// Excludes a candidate at all gates and times: with two gates, moving one is equivalent to moving
// the other.
void Exclude(const Candidate& which, std::vector<Candidate>* candidates) {
  std::erase_if(*candidates, [&](const Candidate& c) { return c.info->id == which.info->id; });
}

// The diagnosis of one flight, without the verdict.
class OneFlight {
 public:
  OneFlight(const FlightLog& log, const DiagnosisOptions& options)
      : log_(log),
        options_(options),
        data_(PrepareLog(log, &options_)),
        gain_logs_{log, log},
        search_(FittedSearch(data_, options_)) {
    diagnosis_.warnings = log.warnings;
  }

  Diagnosis Run() {
    diagnosis_.rms_before = RmsOfFixes(search_->flight(), search_->Whitened());
    TakeOutFalseGate();
    const Eigen::VectorXd before = search_->Whitened();
    const std::vector<ReplayError> replays = ReplayOpenLoop(search_.get(), log_);
    diagnosis_.base_seconds = SecondsSince(start_);
    const Rounds rounds = Search();
    if (HasGates(log_)) diagnosis_.candidates.push_back(false_gate_);
    diagnosis_.unexplained_by = rounds.goes_with;
    Describe(before, replays, rounds);
    return diagnosis_;
  }

 private:
  // The state at the end of one search.
  struct Outcome {
    std::unique_ptr<CauseSearch> search;
    Rounds rounds;
    Diagnosis diagnosis;

    bool ExplainsAll() const {
      return !rounds.found.empty() && rounds.goes_with.empty() &&
             ExtraordinaryNoise(search->fit().noise).empty();
    }
  };

  Outcome SearchAmong(const std::vector<Candidate>& candidates,
                      std::unique_ptr<CauseSearch> search) {
    Outcome outcome{std::move(search), {}, diagnosis_};
    outcome.rounds = SearchCauses(candidates, options_, outcome.search.get());
    StoreCauses(*outcome.search, outcome.rounds, &outcome.diagnosis);
    if (options_.measure_gain) {
      DropHarmful(data_, gain_logs_, options_, outcome.search.get(), &outcome.rounds,
                  &outcome.diagnosis);
    }
    return outcome;
  }

  // A cause that makes held-out flight worse may have kept a correlated one out of the model.
  // Searches again without such causes and takes that result if nothing is left unexplained.
  Rounds Search() {
    constexpr int kSearches = 3;
    std::vector<Candidate> candidates = CandidatesFor(data_, ScopeOf(data_, options_));
    Outcome best = SearchAmong(candidates, std::move(search_));
    best.diagnosis.candidates = best.rounds.candidates;
    std::vector<Cause> aside = best.diagnosis.set_aside;
    for (int i = 1; i < kSearches && !aside.empty(); ++i) {
      for (const Cause& cause : aside) Exclude(cause.candidate, &candidates);
      Outcome next = SearchAmong(candidates, FittedSearch(data_, options_));
      aside = next.diagnosis.set_aside;
      if (!aside.empty() || !next.ExplainsAll()) continue;
      next.diagnosis.candidates = best.diagnosis.candidates;
      next.diagnosis.set_aside = best.diagnosis.set_aside;
      best = std::move(next);
    }
    search_ = std::move(best.search);
    diagnosis_ = std::move(best.diagnosis);
    return best.rounds;
  }

  void TakeOutFalseGate() {
    const auto found = FalseGateBeyondEffects(data_, options_, search_.get());
    if (found) {
      if (!options_.fit_to_mocap) gain_logs_.kept = WithoutFixes(log_, found->fixes);
      data_ = WithoutFixes(data_, found->fixes);
      search_ = FittedSearch(data_, options_);
      diagnosis_.causes.push_back(CauseOf(*found));
    }
    false_gate_ = ReportOf(found, FalseGateAlpha(options_), search_.get());
  }

  void Describe(const Eigen::VectorXd& before, const std::vector<ReplayError>& replays,
                const Rounds& rounds) {
    StoreModel(*search_, &diagnosis_);
    for (const std::string& what : ExtraordinaryNoise(search_->fit().noise)) {
      diagnosis_.unexplained_by.push_back(what);
    }
    const Eigen::VectorXd after = search_->Whitened();
    diagnosis_.rms_after = RmsOfFixes(search_->flight(), after);
    diagnosis_.rows = RowReports(search_->flight(), before, after);
    diagnosis_.whiteness_p_before = WhitenessOf(diagnosis_.rows, &RowReport::before);
    diagnosis_.whiteness_p = WhitenessOf(diagnosis_.rows, &RowReport::after);
    const auto later = rounds.found.empty() ? replays : ReplayOpenLoop(search_.get(), log_);
    diagnosis_.misfit = std::make_shared<Misfit>(TakeApart(log_, search_.get(), replays, later));
  }

  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  const FlightLog& log_;
  DiagnosisOptions options_;
  FlightLog data_;
  GainLogs gain_logs_;
  std::unique_ptr<CauseSearch> search_;
  CandidateReport false_gate_;
  Diagnosis diagnosis_;
};

}  // namespace

Diagnosis Diagnose(const std::vector<FlightLog>& logs, const DiagnosisOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  Diagnosis diagnosis = OneFlight(logs.front(), options).Run();
  for (std::size_t i = 1; i < logs.size(); ++i) {
    AddRepeats(logs.front(), logs[i], options, &diagnosis.causes);
  }
  Confirm(&diagnosis.causes);
  diagnosis.verdict = VerdictOf(diagnosis.causes, diagnosis.set_aside, diagnosis.unexplained_by);
  diagnosis.seconds = SecondsSince(start);
  return diagnosis;
}

}  // namespace trueline
