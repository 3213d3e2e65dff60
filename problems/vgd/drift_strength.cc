#include "problems/vgd/drift_strength.h"

#include <algorithm>
#include <cmath>

#include "problems/vgd/window_data.h"

namespace trueline {
namespace {

constexpr double kFactors[] = {0.125, 0.25, 0.5, 1.0, 2.0, 4.0};  // of options.process.tilt
const double kPriorSpread = std::log(3.0);                        // of the candidates' logarithm
constexpr int kPasses = 2;  // in one piece of evidence: two straights and the arc between them

}  // namespace

DriftStrength::DriftStrength(const VgdOptions& options) : options_(options) {
  for (const double factor : kFactors) {
    candidates_.push_back(factor * options.process.tilt);
    const double z = std::log(factor) / kPriorSpread;
    log_probability_.push_back(-0.5 * z * z);
  }
}

void DriftStrength::Learn(const FlightData& flight, int tau, const Theta& start) {
  if (tau % kPasses != 0 || !flight.HasArc(tau - 1)) return;
  const WindowData data = CutWindow(flight, options_, tau - kPasses, tau, false);
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    options_.process.tilt = candidates_[i];
    WindowProblem problem(flight.track, data, options_);
    problem.SetStart(start, RoughPath(flight.log.fixes, data.passes));
    if (problem.Solve().IsSolutionUsable()) log_probability_[i] += problem.LogEvidence();
  }
}

double DriftStrength::Tilt() const {
  const auto best = std::max_element(log_probability_.begin(), log_probability_.end());
  return candidates_[best - log_probability_.begin()];
}

}  // namespace trueline
