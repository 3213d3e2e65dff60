#include "problems/diagnosis/diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "problems/common/error.h"
#include "problems/diagnosis/confirm.h"
#include "problems/diagnosis/evidence.h"
#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/open_search.h"
#include "problems/diagnosis/rounds.h"
#include "problems/diagnosis/rules.h"
#include "problems/diagnosis/score_test.h"
#include "problems/diagnosis/witness.h"

namespace trueline {
namespace {

using Clock = std::chrono::steady_clock;
using Flight = std::unique_ptr<DiagnosedFlight>;

// Root of the sum of squares over the parameters, against the best of the effect's candidates.
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

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

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

// On most of the other flights.
bool TermRepeats(const DescribedTerm& term) {
  const auto count = std::count_if(term.repeats.begin(), term.repeats.end(),
                                   [](const TermRepeat& r) { return r.repeats; });
  return 2 * count > static_cast<long>(term.repeats.size());
}

// Bonferroni: the test counts as one more entry of the catalogue.
double FalseDataAlpha(const SearchOptions& options) { return options.alpha / 100.0; }

// The diagnosis of the first flight; the others confirm its causes.
class FlightDiagnosis {
 public:
  FlightDiagnosis(const std::vector<FlightLog>& logs, const MakeFlight& make,
                  const SearchOptions& options)
      : logs_(logs), make_(make), options_(options), flight_(make(logs.front())) {
    diagnosis_.warnings = logs.front().warnings;
  }

  Diagnosis Run() {
    Residuals before = flight_->WhitenedResiduals();
    diagnosis_.rms_before = before.rms;  // false data included
    LeaveOutFalseData();
    if (false_data_) before = flight_->WhitenedResiduals();
    const auto false_data_report = flight_->ReportFalseData(false_data_, FalseDataAlpha(options_));
    if (false_data_ && false_data_report) {
      false_data_->times_detectable = TimesDetectable(*false_data_, {*false_data_report});
    }
    const std::vector<ReplayError> replays = flight_->ReplayOpenLoop();
    diagnosis_.base_seconds = SecondsSince(start_);
    Rounds rounds = Search();
    for (Cause& cause : diagnosis_.causes) WidenByWitness(&cause);
    if (false_data_report) diagnosis_.candidates.push_back(*false_data_report);
    diagnosis_.unexplained_by = rounds.goes_with;
    ConfirmOnOthers(&diagnosis_.causes);
    DescribeTerms(&rounds);
    AddSignificantAside(rounds);
    Describe(before, replays, rounds);
    const auto& terms = diagnosis_.open.described;
    diagnosis_.verdict =
        VerdictOf(diagnosis_.causes, diagnosis_.set_aside, diagnosis_.unexplained_by,
                  std::any_of(terms.begin(), terms.end(), TermRepeats));
    ChooseModel(rounds);
    diagnosis_.seconds = SecondsSince(start_);
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
    JudgeCauses(&outcome);
    return outcome;
  }

  void StoreCauses(Outcome* outcome) const {
    outcome->causes = CausesFrom(outcome->rounds, *outcome->flight);
    if (false_data_) outcome->causes.insert(outcome->causes.begin(), *false_data_);
  }

  // Sets aside the causes that may not be named (rules.h), one by one: first the one that its
  // witness refutes most, then the last one found. The others are then fitted and judged again.
  void JudgeCauses(Outcome* outcome) {
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
    if (!ask || Others().empty()) return unnamed;
    ConfirmOnOthers(causes);
    return find();
  }

  void ConfirmOnOthers(std::vector<Cause>* causes) {
    if (causes->empty() && !others_) return;
    for (Cause& cause : *causes) cause.repeats.clear();
    for (const Flight& other : Others()) AddRepeats(logs_.front(), other.get(), causes);
    Confirm(causes);
  }

  // What the open catalogue says of the misfit that is left, and whether other flights show it.
  // Terms that held-out flight shows stay in the fit. Terms that it contradicts, and that no other
  // flight shows, are no description: they follow something else, as a controller that answers a
  // gust does. The misfit stays unexplained.
  void DescribeTerms(Rounds* rounds) {
    std::vector<Found> all = rounds->found;
    OpenCatalogue& open = diagnosis_.open;
    open = DescribeMisfit(flight_.get(), &all, options_.alpha);
    if (!open.described.empty()) {
      for (const Flight& other : Others()) AddTermRepeats(*other, &open.described);
    }
    for (const DescribedTerm& t : open.described) {
      if (!TermRepeats(t)) diagnosis_.unexplained_by.push_back(t.term.Name());
    }
    if (all.size() > rounds->found.size() && !TermsGain(rounds->found, all)) {
      for (DescribedTerm& t : open.described) t.in_model = false;
      if (ClearLoss(diagnosis_.terms_gain, diagnosis_.terms_open_loop)) {
        std::erase_if(open.described, [](const DescribedTerm& t) { return !TermRepeats(t); });
        if (open.described.empty()) diagnosis_.terms_gain = diagnosis_.terms_open_loop = Gain();
      }
      all = rounds->found;
      flight_->Fit(&all);
    }
    const auto terms_at = all.begin() + static_cast<long>(rounds->found.size());
    terms_.assign(terms_at, all.end());
    if (terms_.empty()) return;
    // Causes and terms were fitted together.
    std::copy(all.begin(), terms_at, rounds->found.begin());
    const std::size_t false_data = diagnosis_.causes.size() - rounds->found.size();
    for (std::size_t i = 0; i < rounds->found.size(); ++i) {
      diagnosis_.causes[false_data + i].value = rounds->found[i].value;
    }
  }

  // True if held-out flight is predicted better with the terms, or if that is not asked.
  bool TermsGain(const std::vector<Found>& causes, const std::vector<Found>& all) {
    if (!options_.measure_gain) return true;
    Gain &arcs = diagnosis_.terms_gain, &replays = diagnosis_.terms_open_loop;
    MeasureGain(*flight_, all, causes, &arcs, &replays);
    return ClearGain(arcs, replays);
  }

  // The further flights, without those that can't be diagnosed.
  const std::vector<Flight>& Others() {
    if (others_) return *others_;
    others_.emplace();
    for (std::size_t i = 1; i < logs_.size(); ++i) {
      const FlightLog& log = logs_[i];
      try {
        others_->push_back(make_(log));
      } catch (const InputError& error) {
        diagnosis_.warnings.push_back(
            fmt::format("further flight {}: it can't be diagnosed, so it confirms nothing: {}",
                        log.name.empty() ? std::to_string(i + 1) : log.name, error.what()));
      }
    }
    return *others_;
  }

  // A cause that is set aside may have kept a correlated one out of the model. Searches again
  // without such causes, at all gates and times: with two gates, moving one is equivalent to moving
  // the other. That result holds if a witness refuted the cause, if nothing is left unexplained, or
  // if it names more.
  Rounds Search() {
    constexpr int kSearches = 4;
    std::vector<Candidate> candidates = AllCandidates();
    Outcome best = SearchAmong(candidates, std::move(flight_));
    diagnosis_.candidates = best.rounds.candidates;
    diagnosis_.set_aside = best.set_aside;
    std::vector<Cause> aside = best.set_aside;
    for (int i = 1; i < kSearches; ++i) {
      std::size_t fewer = 0;  // none if a false gate alone is set aside, which is no candidate
      for (const Cause& cause : aside) {
        fewer += std::erase_if(candidates,
                               [&](const Candidate& c) { return c.info == cause.candidate.info; });
      }
      if (fewer == 0) break;
      const bool refuted = std::any_of(aside.begin(), aside.end(), Refuted);
      Outcome next = SearchAmong(candidates, best.flight->WithoutCauses());
      aside = next.set_aside;
      const bool explained = aside.empty() && next.ExplainsAll();
      std::erase_if(aside, [](const Cause& c) { return c.candidate.IsFalseGate(); });
      if (!refuted && !explained && !NamesMore(next.causes, best.causes)) continue;
      best = std::move(next);
      diagnosis_.set_aside.insert(diagnosis_.set_aside.end(), aside.begin(), aside.end());
    }
    flight_ = std::move(best.flight);
    diagnosis_.causes = best.causes;
    diagnosis_.gain = best.gain;
    diagnosis_.open_loop = best.open_loop;
    return best.rounds;
  }

  // A cause that is set aside and still significant beside the others and the terms is a misfit
  // that nothing explains. Without any of these the verdict says so by itself.
  void AddSignificantAside(const Rounds& rounds) {
    std::vector<Candidate> aside;
    for (const Cause& cause : diagnosis_.set_aside) {
      if (!cause.candidate.IsFalseGate()) aside.push_back(cause.candidate);
    }
    aside = Without(aside, rounds.found);
    if (aside.empty() || (diagnosis_.causes.empty() && diagnosis_.open.described.empty())) return;
    const double alpha = options_.alpha / std::max(1, DistinctIds(AllCandidates()));
    const FlightEvidence evidence(*flight_, aside);
    for (const Tested& tested : evidence.tested()) {
      if (!tested.Significant(alpha)) continue;
      diagnosis_.unexplained_by.push_back(tested.candidate.Label() + ", which is set aside");
    }
  }

  // model.yaml gets the causes that can be relied on, unless held-out flight is predicted worse
  // with them, and the constants fitted with these causes.
  void ChooseModel(const Rounds& rounds) {
    Rounds in_model = rounds;
    const auto& causes = diagnosis_.causes;
    const std::size_t false_data = causes.size() - rounds.found.size();
    const bool worse = PredictsWorse(diagnosis_.gain, diagnosis_.open_loop);
    for (std::size_t i = causes.size(); i-- > 0;) {
      if (!worse && Claimed(causes[i])) {
        diagnosis_.in_model.insert(diagnosis_.in_model.begin(), causes[i].effect());
      } else if (i >= false_data) {
        in_model.Remove(i - false_data);
      }
    }
    if (worse) {
      diagnosis_.model_lacks = "all causes, since held-out flight is predicted worse with them";
    } else if (diagnosis_.in_model.size() < causes.size()) {
      diagnosis_.model_lacks = "causes that no other flight confirms";
    }
    std::vector<Found> model = in_model.found;
    ChooseTerms(&model);
    if (model.size() < rounds.found.size() + terms_.size()) {
      flight_->Fit(&model);
      Diagnosis refitted;
      flight_->Describe(&refitted);
      diagnosis_.parameters = refitted.parameters;
      const std::size_t first = diagnosis_.in_model.size() - in_model.found.size();
      for (std::size_t k = 0; k < in_model.found.size(); ++k) {
        diagnosis_.in_model[first + k] = model[k].effect();
      }
    }
    AddTermsToModel(model, in_model.found.size());
    const std::vector<Effect> known = flight_->KnownEffects();
    diagnosis_.in_model.insert(diagnosis_.in_model.begin(), known.begin(), known.end());
  }

  // Adds the terms that no other flight contradicts.
  void ChooseTerms(std::vector<Found>* model) {
    std::size_t next = 0;
    for (DescribedTerm& t : diagnosis_.open.described) {
      if (!t.in_model) continue;
      t.in_model = t.repeats.empty() || TermRepeats(t);
      if (t.in_model) model->push_back(terms_[next]);
      ++next;
    }
  }

  void AddTermsToModel(const std::vector<Found>& model, std::size_t first) {
    for (const DescribedTerm& t : diagnosis_.open.described) {
      if (!t.in_model) continue;
      Effect effect = model[first++].effect();
      effect.values["sigma"] = t.size.sigma;
      diagnosis_.in_model.push_back(effect);
    }
  }

  void Describe(const Residuals& before, const std::vector<ReplayError>& replays,
                const Rounds& rounds) {
    flight_->Describe(&diagnosis_);
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
    const bool bare = rounds.found.empty() && terms_.empty();
    const auto later = bare ? replays : flight_->ReplayOpenLoop();
    diagnosis_.misfit = std::make_shared<Misfit>(MisfitOf(*flight_, replays, later));
  }

  Clock::time_point start_ = Clock::now();
  const std::vector<FlightLog>& logs_;
  const MakeFlight& make_;
  const SearchOptions& options_;
  Flight flight_;
  std::optional<std::vector<Flight>> others_;  // made when first needed
  std::optional<Cause> false_data_;
  std::vector<Found> terms_;  // in the last Fit, after the causes
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
  return FlightDiagnosis(logs, make, options).Run();
}

}  // namespace trueline
