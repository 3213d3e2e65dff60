#include "problems/diagnosis/confirm.h"

#include <algorithm>

namespace trueline {
namespace {

constexpr double kAlpha = 0.05;     // a single test: the hypothesis comes from another flight
constexpr double kSamePlace = 0.5;  // m

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

// True if the flight can show the effect and its gate, if any, is at the same place.
bool Testable(const Candidate& candidate, const FlightLog& first, const DiagnosedFlight& flight) {
  if (candidate.IsStep()) return false;
  const auto candidates = CandidatesFor(flight.drive(), flight.Scope());
  const bool listed = std::any_of(candidates.begin(), candidates.end(),
                                  [&](const Candidate& c) { return c.info == candidate.info; });
  const auto gate = candidate.fixed.find("gate");
  if (!listed || gate == candidate.fixed.end()) return listed;
  const Gate* here = GateOf(first, static_cast<int>(gate->second));
  const Gate* there = GateOf(flight.log(), static_cast<int>(gate->second));
  return here != nullptr && there != nullptr &&
         (here->position - there->position).norm() < kSamePlace;
}

Eigen::Vector3d OffsetOf(const Cause& false_gate) {
  const auto& fixed = false_gate.candidate.fixed;
  return {fixed.at("dx"), fixed.at("dy"), fixed.at("dz")};
}

Repeat RepeatOfFalseData(const Cause& cause, const DiagnosedFlight& flight) {
  const auto found = flight.FindFalseData(kAlpha);
  if (!found) return {"", "not shown", {}, {}, 1.0};
  const bool same = (OffsetOf(*found) - OffsetOf(cause)).norm() < kSamePlace;
  return {"", same ? "repeats" : "differs", found->value, found->sigma, found->p};
}

// The result of a cause fitted at `value` and tested singly.
Repeat RepeatOf(const Cause& cause, const Eigen::VectorXd& value, const ScoreTest& test) {
  const char* outcome = "not shown";
  if (test.p() < kAlpha) outcome = Agrees(cause, value, test.sigma) ? "repeats" : "differs";
  return {"", outcome, value, test.sigma, test.p()};
}

}  // namespace

void AddRepeats(const FlightLog& first, DiagnosedFlight* flight, std::vector<Cause>* causes) {
  std::vector<Found> found;
  std::vector<Cause*> tested;
  const bool false_gate = std::any_of(causes->begin(), causes->end(), [](const Cause& cause) {
    return cause.candidate.IsFalseGate();
  });
  if (false_gate) flight->Fit(&found);  // FindFalseData needs a fit without causes
  for (Cause& cause : *causes) {
    cause.repeats.push_back({"", "can't be tested", {}, {}, 1.0});
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
      tested[k]->repeats.back() = RepeatOf(*tested[k], found[k].value, TestFound(*fit, found, k));
    }
  }
  for (Cause& cause : *causes) cause.repeats.back().log = flight->log().directory;
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
