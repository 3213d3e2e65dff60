#include "problems/smoother/hypothesis.h"

#include <cmath>

#include "problems/vgd/flight_data.h"

namespace trueline {
namespace {

// If the newest pass fits a marginalised past with log odds above this, no alternative is tested.
constexpr double kClear = 3.0;

// The passes that are not false (all, if every one is), for the start of the search.
std::vector<Pass> TrustedPasses(const WindowQuestion& question, const std::set<int>& false_passes) {
  const auto& all = question.flight.passes;
  std::vector<Pass> passes;
  for (int k = question.first; k < question.tau; ++k) {
    if (false_passes.count(k) == 0) passes.push_back(all[k]);
  }
  if (passes.empty()) passes.assign(all.begin() + question.first, all.begin() + question.tau);
  return passes;
}

// Without a past, at least one pass must be true: nothing else determines the position.
bool IsPossible(const WindowQuestion& question, const std::set<int>& false_passes, bool lost) {
  const bool all_false = static_cast<int>(false_passes.size()) == question.tau - question.first;
  return !all_false || (question.past && !lost);
}

std::set<int> Flipped(std::set<int> passes, int k) {
  if (passes.erase(k) == 0) passes.insert(k);
  return passes;
}

// Replaces `best` by the most probable hypothesis that differs from it in one pass or in `lost`.
// True if any is better.
bool Improve(const WindowQuestion& question, Hypothesis* best) {
  const std::set<int> from = best->false_passes;
  const bool lost = best->lost;
  bool improved = false;
  const auto attempt = [&](const std::set<int>& passes, bool is_lost) {
    if (!IsPossible(question, passes, is_lost)) return;
    Hypothesis other = SolveUnder(question, passes, is_lost);
    if (!(other.log_probability > best->log_probability)) return;
    *best = std::move(other);
    improved = true;
  };
  for (int k = question.first; k < question.tau; ++k) attempt(Flipped(from, k), lost);
  if (!lost && question.past_if_lost) attempt({}, true);
  return improved;
}

}  // namespace

Hypothesis SolveUnder(const WindowQuestion& question, const std::set<int>& false_passes,
                      bool lost) {
  const FalsePassOptions& options = question.options;
  Hypothesis hypothesis{false_passes, lost, {}, nullptr, {}, 0.0};
  hypothesis.data = CutWindow(question.flight, question.vgd, question.first, question.tau, true);
  for (const int k : false_passes) {
    hypothesis.data.offsets.push_back(
        {k - question.first, FalsePassOptions::kOffset, FalsePassOptions::kOffsetRate});
  }
  hypothesis.problem =
      std::make_unique<WindowProblem>(question.flight.track, hypothesis.data, question.vgd,
                                      lost ? question.past_if_lost : question.past);
  const std::vector<Pass> trusted = TrustedPasses(question, false_passes);
  hypothesis.problem->SetStart(question.start, RoughPath(question.flight.log.fixes, trusted));
  hypothesis.summary = hypothesis.problem->Solve();
  if (options.probability <= 0.0) return hypothesis;
  const double odds = std::log(options.probability / (1.0 - options.probability));
  hypothesis.log_probability = hypothesis.problem->LogEvidence() +
                               odds * static_cast<double>(false_passes.size()) +
                               (lost ? std::log(FalsePassOptions::kLost) : 0.0);
  return hypothesis;
}

Hypothesis MostProbable(const WindowQuestion& question, const std::set<int>& last) {
  Hypothesis best = SolveUnder(question, last, false);
  if (question.options.probability <= 0.0) return best;
  const std::set<int> flipped = Flipped(last, question.tau - 1);
  if (IsPossible(question, flipped, false)) {
    const Hypothesis other = SolveUnder(question, flipped, false);
    const bool agrees = best.log_probability > other.log_probability + kClear;
    if (agrees && last.empty() && question.past) return best;
  }
  while (Improve(question, &best)) {
  }
  return best;
}

}  // namespace trueline
