#include "problems/diagnosis/confirm.h"

#include <algorithm>
#include <cmath>

#include "problems/diagnosis/cause_rounds.h"
#include "problems/diagnosis/false_gate.h"
#include "problems/diagnosis/prepare_log.h"

namespace trueline {
namespace {

constexpr double kAlpha = 0.05;  // a single test: the hypothesis comes from another flight

bool IsFalseGate(const Cause& cause) { return cause.candidate.info->id == "false_gate"; }

// True if signs agree and sizes are compatible.
bool Agrees(const Cause& cause, const Eigen::VectorXd& value, const Eigen::VectorXd& sigma) {
  constexpr double kApart = 3.0;  // sigmas
  const Eigen::VectorXd neutral = cause.candidate.Neutral();
  const Eigen::VectorXd a = (cause.value - neutral).cwiseQuotient(cause.sigma);
  const Eigen::VectorXd b = (value - neutral).cwiseQuotient(cause.sigma);
  const double ratio = a.dot(b) / a.squaredNorm();
  if (ratio <= 0.0) return false;
  const Eigen::VectorXd both = (sigma.cwiseAbs2() + cause.sigma.cwiseAbs2()).cwiseSqrt();
  const bool close = ((value - cause.value).cwiseQuotient(both)).cwiseAbs().maxCoeff() < kApart;
  return close || (ratio > 0.5 && ratio < 2.0);
}

const Gate* GateOf(const FlightLog& log, int id) {
  for (const Gate& gate : log.gates) {
    if (gate.id == id) return &gate;
  }
  return nullptr;
}

// True if the effect is testable on the log and its gate, if any, is at the same place.
bool Testable(const Candidate& candidate, const FlightLog& first, const FlightLog& log,
              const DiagnosisOptions& options) {
  constexpr double kSamePlace = 0.5;  // m
  const auto candidates = CandidatesFor(log, ScopeOf(log, options));
  const bool listed = std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
    return c.info->id == candidate.info->id;
  });
  const auto gate = candidate.fixed.find("gate");
  if (!listed || gate == candidate.fixed.end()) return listed;
  const Gate* here = GateOf(first, static_cast<int>(gate->second));
  const Gate* there = GateOf(log, static_cast<int>(gate->second));
  return here != nullptr && there != nullptr &&
         (here->position - there->position).norm() < kSamePlace;
}

Repeat RepeatOfFalseGate(const Cause& cause, CauseSearch* search) {
  constexpr double kSamePlace = 0.5;  // m
  const auto found = FindFalseGate(search->flight(), search->fit(), kAlpha);
  if (!found) return {"", "not shown", {}, {}, 1.0};
  const auto& fixed = cause.candidate.fixed;
  const Eigen::Vector3d offset(fixed.at("dx"), fixed.at("dy"), fixed.at("dz"));
  const bool same = (found->offset - offset).norm() < kSamePlace;
  return {"", same ? "repeats" : "differs", Eigen::VectorXd::Constant(1, found->fraction),
          Eigen::VectorXd::Constant(1, found->sigma), found->p};
}

}  // namespace

Repeat RepeatOf(const Cause& cause, const Eigen::VectorXd& value, const ScoreTest& test) {
  const char* outcome = "not shown";
  if (test.p() < kAlpha) outcome = Agrees(cause, value, test.sigma) ? "repeats" : "differs";
  return {"", outcome, value, test.sigma, test.p()};
}

void AddRepeats(const FlightLog& first, const FlightLog& log, const DiagnosisOptions& given,
                std::vector<Cause>* causes) {
  if (causes->empty()) return;
  DiagnosisOptions options = given;
  const FlightLog data = PrepareLog(log, &options);
  CauseSearch search(data, OpenPriors(options.vgd));
  std::vector<Found> found;
  search.Fit(&found, 0);
  std::vector<Repeat> repeats(causes->size(), {"", "can't be tested", {}, {}, 1.0});
  std::vector<std::size_t> tested;
  for (std::size_t i = 0; i < causes->size(); ++i) {
    const Cause& cause = (*causes)[i];
    if (IsFalseGate(cause)) {
      repeats[i] = RepeatOfFalseGate(cause, &search);
    } else if (Testable(cause.candidate, first, log, options)) {
      found.push_back({cause.candidate, cause.value});
      tested.push_back(i);
    }
  }
  if (!found.empty()) Refit(&search, &found);
  for (std::size_t k = 0; k < found.size(); ++k) {
    repeats[tested[k]] = RepeatOf((*causes)[tested[k]], found[k].value, search.TestFound(found, k));
  }
  for (std::size_t i = 0; i < causes->size(); ++i) {
    repeats[i].log = log.directory;
    (*causes)[i].repeats.push_back(repeats[i]);
  }
}

void Confirm(std::vector<Cause>* causes) {
  for (Cause& cause : *causes) {
    if (cause.repeats.empty()) continue;
    const auto count = std::count_if(cause.repeats.begin(), cause.repeats.end(),
                                     [](const Repeat& r) { return r.outcome == "repeats"; });
    cause.confirmed = 2 * count > static_cast<long>(cause.repeats.size());
  }
}

}  // namespace trueline
