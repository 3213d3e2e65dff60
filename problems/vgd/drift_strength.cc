#include "problems/vgd/drift_strength.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/vgd/window_data.h"

namespace trueline {
namespace {

constexpr double kFactors[] = {0.125, 0.25, 0.5, 1.0, 2.0, 4.0};  // of options.process.tilt
const double kPriorSpread = std::log(3.0);                        // of the candidates' logarithm
constexpr double kMisfit = 2.0;  // mean square of whitened residuals that no drift explains
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
  std::vector<double> evidence;
  double least_cost = std::numeric_limits<double>::infinity();
  for (const double candidate : candidates_) {
    options_.process.tilt = candidate;
    WindowProblem problem(flight.track, data, options_);
    problem.SetStart(start, RoughPath(flight.log.fixes, data.passes));
    least_cost = std::min(least_cost, problem.Solve().final_cost);
    evidence.push_back(problem.LogEvidence());
  }
  // Where no drift makes the two passes fit together, the fixes are false; such a pair would shout
  // down all others. (A cost is half a sum of squares of about one for each residual.)
  const double residuals = 3.0 * data.fixes.size() + 2.0 * data.forces.size();
  if (least_cost > 0.5 * kMisfit * residuals) return;
  for (std::size_t i = 0; i < candidates_.size(); ++i) log_probability_[i] += evidence[i];
}

double DriftStrength::Tilt() const {
  const auto best = std::max_element(log_probability_.begin(), log_probability_.end());
  return candidates_[best - log_probability_.begin()];
}

}  // namespace trueline
