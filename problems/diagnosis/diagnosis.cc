#include "problems/diagnosis/diagnosis.h"

#include <algorithm>
#include <chrono>
#include <map>

#include "problems/diagnosis/cause_search.h"
#include "problems/diagnosis/evidence.h"
#include "problems/diagnosis/evidence_sum.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/rules.h"
#include "problems/diagnosis/witness.h"

namespace trueline {
namespace {

using Clock = std::chrono::steady_clock;
using Flight = std::unique_ptr<DiagnosedFlight>;

// Bonferroni: the test counts as one more entry of the catalogue.
double FalseDataAlpha(const SearchOptions& options) { return options.alpha / 100.0; }

// Silence about an effect says something only from its detectable size on.
std::vector<std::string> NotShown(const std::vector<CandidateReport>& candidates) {
  std::map<std::string, bool> shown;
  for (const CandidateReport& report : candidates) {
    const Eigen::VectorXd plausible = EachOf(report.parameters(), &EffectParameterInfo::plausible);
    const bool all = (report.detectable.array() < plausible.array()).all();
    shown[report.id] = shown[report.id] || all;
  }
  std::vector<std::string> ids;
  for (const auto& [id, is] : shown) {
    if (!is) ids.push_back(id);
  }
  return ids;
}

bool Repeats(const DescribedTerm& term) { return term.confirmed.value_or(false); }

// The diagnosis of the first flight; the others confirm its causes.
class FlightDiagnosis {
 public:
  FlightDiagnosis(const std::vector<FlightLog>& logs, const MakeFlight& make,
                  const SearchOptions& options)
      : options_(options), flight_(make(logs.front())), others_(logs, make) {
    diagnosis_.warnings = logs.front().warnings;
    diagnosis_.evidence_needed = EvidenceNeeded(options.alpha);
  }

  Diagnosis Run() {
    diagnosis_.before = flight_->WhitenedResiduals();
    const double rms = diagnosis_.before.rms;
    LeaveOutFalseData();
    if (false_data_) {
      diagnosis_.before = flight_->WhitenedResiduals();
      diagnosis_.before.rms = rms;
    }
    const auto false_data_report = flight_->ReportFalseData(false_data_, FalseDataAlpha(options_));
    if (false_data_) {
      false_data_->evidence.flight = EvidenceOfChance(false_data_->p);
      false_data_->evidence.prior = -std::log(1.0 + DistinctIds(flight_->AllCandidates()));
    }
    const std::vector<ReplayError> replays = flight_->ReplayOpenLoop();
    diagnosis_.base_seconds = SecondsSince(start_);
    Rounds rounds = Search();
    for (Cause& cause : diagnosis_.causes) WidenByWitness(&cause);
    others_.Confirm(&diagnosis_.causes);
    if (options_.against) {  // references neither confirm nor refute what has changed
      for (Cause& cause : diagnosis_.causes) cause.confirmed.reset();
    }
    DescribeTerms(&rounds);
    JudgeBesideTerms(&rounds);
    AddRemaining(rounds);
    WidenDetectable(*rounds.first.tests, unstated_, AlphaOfOne(), &diagnosis_.candidates);
    if (false_data_report) diagnosis_.candidates.push_back(*false_data_report);
    diagnosis_.not_shown = NotShown(diagnosis_.candidates);
    AddSignificantAside(rounds);
    diagnosis_.set_aside.insert(diagnosis_.set_aside.end(), explained_.begin(), explained_.end());
    Describe(replays, rounds);
    ChooseModel(rounds, terms_, flight_.get(), &diagnosis_);
    SetSharedAside();
    const auto& terms = diagnosis_.open.described;
    diagnosis_.verdict =
        VerdictOf(diagnosis_.causes, diagnosis_.set_aside, diagnosis_.unexplained_by,
                  options_.alpha, std::ranges::any_of(terms, Repeats));
    const std::vector<std::string>& warnings = others_.warnings();
    diagnosis_.warnings.insert(diagnosis_.warnings.end(), warnings.begin(), warnings.end());
    diagnosis_.seconds = SecondsSince(start_);
    return diagnosis_;
  }

 private:
  // Of one effect of the catalogue.
  double AlphaOfOne() const {
    return options_.alpha / std::max(1, DistinctIds(flight_->AllCandidates()));
  }

  // False data that remain after the catalogue's effects are fitted: a strongly rotated camera also
  // displaces all fixes of a pass. Terms that are significant beside them must be explained by
  // them, unless no misfit of the model moves fixes so.
  void LeaveOutFalseData() {
    const double alpha = FalseDataAlpha(options_);
    const auto found = flight_->FindFalseData(alpha);
    if (!found) return;
    const Flight trial = flight_->WithoutCauses();
    const auto terms_of = [&](DiagnosedFlight* flight) {
      return SearchCauses(flight->AllCandidates(), options_, flight).remaining.size();
    };
    const std::size_t terms = terms_of(trial.get());
    const auto left = trial->FindFalseData(alpha);
    if (!left) return;
    Flight without = flight_->WithoutFalseData(alpha);
    const bool misfit = terms > 0 && !left->beside_any_path;
    if (misfit && terms_of(without->WithoutCauses().get()) >= terms) return;
    false_data_ = found;
    flight_ = std::move(without);
  }

  // What the open catalogue says of the misfit that is left, and whether other flights show it.
  // Terms that held-out flight shows stay in the fit. Terms that it contradicts, and that no other
  // flight shows, are no description: they follow something else, as a controller that answers a
  // gust does. The misfit stays unexplained.
  void DescribeTerms(Rounds* rounds) {
    std::vector<Found> all = rounds->found;
    OpenCatalogue& open = diagnosis_.open;
    open = DescribeMisfit(flight_.get(), &all, options_.alpha);
    others_.Confirm(&open.described);
    if (all.size() > rounds->found.size() && !TermsGain(rounds->found, all)) {
      for (DescribedTerm& t : open.described) t.in_model = false;
      if (ClearLoss(diagnosis_.terms_gains)) {
        std::erase_if(open.described, [](const DescribedTerm& t) { return !Repeats(t); });
        if (open.described.empty()) diagnosis_.terms_gains = {};
      }
      all = rounds->found;
      flight_->Fit(&all);
    }
    if (all.size() > rounds->found.size()) StoreValues(all, rounds);
  }

  // What the references show, too, belongs to the model and is no change.
  void SetSharedAside() {
    std::vector<Cause>& causes = diagnosis_.causes;
    for (Cause& cause : causes) {
      if (!cause.shared) continue;
      cause.because = "the references show it, too";
      diagnosis_.set_aside.push_back(cause);
    }
    std::erase_if(causes, [](const Cause& cause) { return cause.shared; });
  }

  // A misfit that no possible effect states is a rival explanation: a cause must be shown beside
  // the terms that describe it, and beside effects of impossible sizes, each of which may be but
  // like the error that is there. The least significant that is not shown goes. The others are then
  // fitted and judged anew: the misfit may have come from it.
  void JudgeBesideTerms(Rounds* rounds) {
    const std::vector<Candidate> rivals = Without(rounds->impossible, rounds->found);
    if (terms_.empty() && rivals.empty() && rounds->remaining.empty()) return;
    std::vector<double> alone;
    for (const Cause& cause : diagnosis_.causes) alone.push_back(cause.evidence.flight);
    while (!rounds->found.empty()) {
      std::vector<Found> all = Concatenated(rounds->found, terms_);
      const std::vector<Beside> beside = JudgeBeside(rivals, all, *rounds);
      const std::size_t first = FalseData(*rounds);
      std::size_t least = beside.size();
      for (std::size_t i = 0; i < beside.size(); ++i) {
        Cause& cause = diagnosis_.causes[first + i];
        cause.evidence.flight = std::min(alone[first + i], beside[i].evidence);
        cause.because = WhyNotNamed(cause, options_.alpha);
        if (cause.because.empty()) continue;
        if (least == beside.size() || beside[i].z < beside[least].z) least = i;
      }
      if (least == beside.size()) return;
      Cause& cause = diagnosis_.causes[first + least];
      cause.because += ", beside what describes the rest of the misfit";
      diagnosis_.set_aside.push_back(cause);
      EraseAt(first + least, &diagnosis_.causes);
      EraseAt(first + least, &alone);
      EraseAt(least, &rounds->found);
      all = Concatenated(rounds->found, terms_);
      flight_->Fit(&all);
      StoreValues(all, rounds);
    }
  }

  // What the flight says of a cause, beside the misfit that remains and without it.
  struct Beside {
    double evidence, z;
  };
  // Stores what that misfit adds to the error of each cause.
  std::vector<Beside> JudgeBeside(const std::vector<Candidate>& rivals,
                                  const std::vector<Found>& all, const Rounds& rounds) {
    std::vector<Candidate> others = rivals;
    for (const Candidate& c : Without(flight_->AllCandidates(), rounds.found)) {
      if (std::ranges::count(rivals, c) == 0) others.push_back(c);
    }
    const FlightEvidence rest(*flight_, others, options_.alpha);
    unstated_ = StrongestOf(RemainingTerms(rest, options_.alpha));
    std::vector<int> beside;
    for (std::size_t k = 0; k < rivals.size(); ++k) {
      beside = Concatenated(std::move(beside), rest.fit().candidates[k].columns);
    }
    std::vector<Beside> judged;
    for (std::size_t i = 0; i < rounds.found.size(); ++i) {
      Cause& cause = diagnosis_.causes[FalseData(rounds) + i];
      const UnstatedErrors errors =
          UnstatedErrorsOf(rest.fit(), all[i].candidate, rest.fit().found[i], rest.fit().Beside(i),
                           others, unstated_);
      cause.unstated_sigma = MeanSigma(errors, cause.value.size());
      AddOthersEvidence(options_, &cause);
      const ScoreTest test = TestFound(rest.fit(), all, i);
      judged.push_back(
          {FlightEvidenceOf(beside.empty() ? test : TestFound(rest.fit(), all, i, beside),
                            PriorSizes(*all[i].candidate.info), errors),
           test.z()});
    }
    return judged;
  }

  // Of causes and terms that were fitted together.
  void StoreValues(const std::vector<Found>& all, Rounds* rounds) {
    const auto terms_at = all.begin() + static_cast<long>(rounds->found.size());
    terms_.assign(terms_at, all.end());
    std::copy(all.begin(), terms_at, rounds->found.begin());
    for (std::size_t i = 0; i < rounds->found.size(); ++i) {
      diagnosis_.causes[FalseData(*rounds) + i].value = rounds->found[i].value;
    }
  }

  // What is correlated with the residual, tested again where terms are in the model, and terms that
  // no other flight shows.
  void AddRemaining(const Rounds& rounds) {
    std::vector<std::string>& by = diagnosis_.unexplained_by;
    std::vector<TestedTerm> remaining = rounds.remaining;
    if (!terms_.empty()) {
      const FlightEvidence rest(*flight_, {}, options_.alpha);
      remaining = RemainingTerms(rest, options_.alpha);
      unstated_ = StrongestOf(remaining);
    }
    for (const TestedTerm& t : remaining) by.push_back(t.name);
    for (const DescribedTerm& t : diagnosis_.open.described) {
      if (!Repeats(t)) by.push_back(t.term.Name());
    }
  }

  // True if held-out flight is predicted better with the terms, or if that is not asked.
  bool TermsGain(const std::vector<Found>& causes, const std::vector<Found>& all) {
    if (!options_.measure_gain) return true;
    diagnosis_.terms_gains = MeasureGain(*flight_, all, causes);
    return ClearGain(diagnosis_.terms_gains);
  }

  Rounds Search() {
    NamedCauses search = SearchNamedCauses(std::move(flight_), false_data_, options_, &others_);
    flight_ = std::move(search.flight);
    diagnosis_.candidates = search.rounds.first.candidates;
    diagnosis_.causes = search.causes;
    diagnosis_.set_aside = search.set_aside;
    explained_ = search.explained;
    unstated_ = StrongestOf(search.rounds.remaining);
    diagnosis_.gains = search.gains;
    return search.rounds;
  }

  // A cause that is set aside and still significant beside the others and the terms is a misfit
  // that nothing explains, and moves their sizes. One that is no longer significant, and beside
  // which less than half of a cause is left, explains the same misfit. Without causes or terms the
  // verdict says so by itself.
  void AddSignificantAside(const Rounds& rounds) {
    std::vector<Candidate> aside;
    for (const Cause& cause : diagnosis_.set_aside) {
      if (!cause.candidate.IsFalseGate()) aside.push_back(cause.candidate);
    }
    aside = Without(aside, rounds.found);
    if (aside.empty() || (diagnosis_.causes.empty() && diagnosis_.open.described.empty())) return;
    const double alpha = AlphaOfOne();
    const FlightEvidence evidence(*flight_, aside, options_.alpha);
    for (const Tested& tested : evidence.tested()) {
      const bool remains = tested.Significant(alpha);
      if (remains) {
        diagnosis_.unexplained_by.push_back(tested.candidate.Label() + ", which is set aside");
      }
      for (std::size_t i = 0; i < rounds.found.size(); ++i) {
        Compare(rounds.found[i], TestFound(evidence.fit(), rounds.found, i, tested.columns.columns),
                tested, remains, &diagnosis_.causes[FalseData(rounds) + i]);
      }
    }
  }

  // `beside`: the test of the cause beside the one that is set aside.
  void Compare(const Found& found, const ScoreTest& beside, const Tested& aside, bool remains,
               Cause* cause) const {
    if (remains) {
      const Eigen::VectorXd moved = beside.value - (found.value - found.candidate.Neutral());
      const Eigen::VectorXd square = cause->sigma.cwiseAbs2();
      const auto chance = (beside.sigma.cwiseAbs2() - square).cwiseMax(0.0);
      cause->sigma = (square + BeyondChance(moved, chance)).cwiseSqrt();
    } else if (!RetainsHalf(found, beside) && !IsRefuted(aside.candidate)) {
      cause->confused_with.push_back(aside.candidate.Label());
    }
  }

  bool IsRefuted(const Candidate& candidate) const {
    return std::ranges::any_of(diagnosis_.set_aside, [&](const Cause& cause) {
      return Refuted(cause, options_.alpha) && cause.candidate.Label() == candidate.Label();
    });
  }

  // Causes that are false data, which come first and are not in the fit.
  std::size_t FalseData(const Rounds& rounds) const {
    return diagnosis_.causes.size() - rounds.found.size();
  }

  void Describe(const std::vector<ReplayError>& replays, const Rounds& rounds) {
    flight_->Describe(&diagnosis_);
    for (const std::string& what : flight_->ExtraordinaryNoise()) {
      diagnosis_.unexplained_by.push_back(what);
    }
    diagnosis_.after = flight_->WhitenedResiduals();
    const bool bare = rounds.found.empty() && terms_.empty();
    const auto later = bare ? replays : flight_->ReplayOpenLoop();
    diagnosis_.misfit = std::make_shared<Misfit>(MisfitOf(*flight_, replays, later));
  }

  Clock::time_point start_ = Clock::now();
  const SearchOptions& options_;
  Flight flight_;
  FurtherFlights others_;
  std::optional<Cause> false_data_;
  std::vector<Cause> explained_;  // by the named causes
  std::vector<Found> terms_;      // in the last Fit, after the causes
  double unstated_ = 0.0;         // merit of the misfit that is left
  Diagnosis diagnosis_;
};

}  // namespace

Diagnosis Diagnose(const std::vector<FlightLog>& logs, const MakeFlight& make,
                   const SearchOptions& options) {
  return FlightDiagnosis(logs, make, options).Run();
}

}  // namespace trueline
