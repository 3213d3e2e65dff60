#include "problems/diagnosis/confirm.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/diagnosis/false_gate.h"
#include "problems/diagnosis/score_test.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/log/samples.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

constexpr char kNotTested[] = "can't be tested";

// True if signs agree and sizes, from the neutral value, are compatible: by their ratio, or within
// `apart` sigmas.
bool Agree(const SizeEstimate& first, const SizeEstimate& other, double apart) {
  const double ratio = ShareLeft(other.value, first.value, first.sigma);
  if (ratio <= 0.0) return false;
  const Eigen::VectorXd both = (other.sigma.cwiseAbs2() + first.sigma.cwiseAbs2()).cwiseSqrt();
  const double sigmas = (other.value - first.value).cwiseQuotient(both).cwiseAbs().maxCoeff();
  return sigmas < apart || (ratio > kMostOf && ratio < 1.0 / kMostOf);
}

// True if the flight can show the effect and its gate, if any, is at the same place.
bool Testable(const Candidate& candidate, const FlightLog& first, const DiagnosedFlight& flight) {
  if (candidate.IsStep()) return false;
  const bool listed =
      std::ranges::count(flight.AllCandidates(), candidate.info, &Candidate::info) > 0;
  const auto gate = candidate.fixed.find("gate");
  if (!listed || gate == candidate.fixed.end()) return listed;
  const Gate* here = GateOf(first, static_cast<int>(gate->second));
  const Gate* there = GateOf(flight.log(), static_cast<int>(gate->second));
  return here != nullptr && there != nullptr &&
         (here->position - there->position).norm() < kSamePlace;
}

Repeat RepeatOfFalseData(const Cause& cause, const DiagnosedFlight& flight) {
  const auto found = flight.FindFalseData(kSingleAlpha);
  if (!found) return {"", "not shown"};
  const bool same = (OffsetOf(found->candidate) - OffsetOf(cause.candidate)).norm() < kSamePlace;
  return {"", same ? "repeats" : "differs", found->value, found->sigma, found->p};
}

// The result of an effect that is fitted at `value` and tested singly.
Repeat RepeatOf(const SizeEstimate& first, const Eigen::VectorXd& value,
                const Eigen::VectorXd& neutral, const ScoreTest& test, double apart) {
  const bool agree = Agree(first, {value - neutral, test.sigma}, apart);
  const char* outcome = "not shown";
  if (test.p() < kSingleAlpha) outcome = agree ? "repeats" : "differs";
  return {"", outcome, value, test.sigma, test.p()};
}

// The term numbered k of `fit`, tested beside the others.
Repeat RepeatOfTerm(const DescribedTerm& first, const Linearisation& fit, std::size_t k) {
  std::vector<int> beside = fit.nuisances;
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    if (i != k) beside.push_back(fit.terms[i].columns.front());
  }
  const ScoreTest test = TestColumns(fit, beside, fit.terms[k].columns, Eigen::VectorXd::Zero(1));
  const auto vector = [](double x) -> Eigen::VectorXd { return Eigen::VectorXd::Constant(1, x); };
  return RepeatOf({vector(first.size.value), vector(first.size.sigma)}, test.value, vector(0.0),
                  test, kChanceSigmas);
}

// Whether it repeats on more than half of the flights that can test it; empty if there are none. A
// flight that lacks what belongs to another one (`of_one_flight`) does not tell.
std::optional<bool> MostRepeat(const std::vector<Repeat>& outcomes, bool of_one_flight) {
  const auto count = [&](const char* outcome) {
    return std::ranges::count(outcomes, outcome, &Repeat::outcome);
  };
  const auto tested = std::ssize(outcomes) - count(kNotTested);
  const bool most = 2 * count("repeats") > tested;
  if (tested == 0 || (of_one_flight && !most)) return std::nullopt;
  return most;
}

// Adds to each cause of the flight with the log `first` its estimate on `flight`.
void AddRepeats(const FlightLog& first, DiagnosedFlight* flight, std::vector<Cause>* causes) {
  std::vector<Found> found;
  std::vector<Cause*> tested;
  const bool false_gate = std::ranges::any_of(
      *causes, [](const Cause& cause) { return cause.candidate.IsFalseGate(); });
  if (false_gate) flight->Fit(&found);  // FindFalseData needs a fit without causes
  for (Cause& cause : *causes) {
    cause.repeats.push_back({"", kNotTested});
    if (cause.candidate.IsFalseGate()) {
      cause.repeats.back() = RepeatOfFalseData(cause, *flight);
    } else if (Testable(cause.candidate, first, *flight)) {
      found.push_back({cause.candidate, cause.value});
      tested.push_back(&cause);
    }
  }
  // Without causes to test the flight may already be fitted so.
  if (!found.empty() || !false_gate) flight->Fit(&found);
  if (!found.empty()) {
    const auto fit = flight->Linearise({}, false);
    for (std::size_t k = 0; k < found.size(); ++k) {
      const Cause& cause = *tested[k];
      const Eigen::VectorXd neutral = cause.candidate.Neutral();
      tested[k]->repeats.back() = RepeatOf({cause.value - neutral, cause.sigma}, found[k].value,
                                           neutral, TestFound(*fit, found, k), kApartSigmas);
    }
  }
  for (Cause& cause : *causes) cause.repeats.back().log = flight->log().directory;
}

// Adds what another flight, fitted with the causes, says of the terms.
void AddTermRepeats(const DiagnosedFlight& other, std::vector<DescribedTerm>* terms) {
  std::vector<TermForm> columns;
  std::vector<DescribedTerm*> tested;
  for (DescribedTerm& t : *terms) {
    t.repeats.push_back({other.log().directory, kNotTested});
    const bool voltage = std::ranges::count(t.term.with, TermQuantity::kVoltage, &TermFactor::of);
    if (voltage && other.log().battery.empty()) continue;
    tested.push_back(&t);
    columns.push_back(t.term);
    BindTerms(other.log(), &columns.back().with);
  }
  if (tested.empty()) return;
  const auto fit = other.LineariseTerms(columns);
  for (std::size_t k = 0; k < tested.size(); ++k) {
    tested[k]->repeats.back() = RepeatOfTerm(*tested[k], *fit, k);
    tested[k]->repeats.back().log = other.log().directory;
  }
}

}  // namespace

const std::vector<std::unique_ptr<DiagnosedFlight>>& FurtherFlights::All() {
  if (flights_) return *flights_;
  flights_.emplace();
  for (std::size_t i = 1; i < logs_.size(); ++i) {
    const FlightLog& log = logs_[i];
    try {
      flights_->push_back(make_(log));
    } catch (const InputError& error) {
      warnings_.push_back(
          fmt::format("further flight {}: it can't be diagnosed, so it confirms nothing: {}",
                      log.name.empty() ? std::to_string(i + 1) : log.name, error.what()));
    }
  }
  return *flights_;
}

void FurtherFlights::Confirm(std::vector<Cause>* causes) {
  if (causes->empty() && !flights_) return;
  for (Cause& cause : *causes) cause.repeats.clear();
  for (const auto& flight : All()) AddRepeats(logs_.front(), flight.get(), causes);
  JudgeRepeats(causes);
}

void FurtherFlights::Confirm(std::vector<DescribedTerm>* terms) {
  if (terms->empty()) return;
  for (const auto& flight : All()) AddTermRepeats(*flight, terms);
  for (DescribedTerm& t : *terms) {
    t.confirmed =
        MostRepeat(t.repeats, IsOfOneFlight({"term", {}, std::make_shared<TermForm>(t.term)}));
  }
}

void JudgeRepeats(std::vector<Cause>* causes) {
  for (Cause& cause : *causes) {
    cause.confirmed = MostRepeat(cause.repeats, cause.candidate.info->of_one_flight);
  }
}

}  // namespace trueline
