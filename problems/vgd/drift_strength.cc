#include "problems/vgd/drift_strength.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/vgd/vgd.h"
#include "problems/vgd/window_data.h"

namespace trueline {
namespace {

constexpr double kFactors[] = {0.125, 0.25, 0.5, 1.0, 2.0, 4.0};  // of options.process.tilt
const double kPriorSpread = std::log(3.0);                        // of the candidates' logarithm
constexpr double kMisfit = 2.0;  // mean square of whitened residuals that no drift explains
constexpr int kPasses = 2;       // in one piece of evidence: two straights and the arc between them

// One of the two passes is false: how rare that is, and how its fixes are off then.
const double kLogFalse = std::log(0.1);
constexpr double kFalseOffset = 2.0;      // m
constexpr double kFalseOffsetRate = 0.2;  // m/s
// Less evidence than the best candidate's by this much may be a false pass's doing.
constexpr double kDoubt = 5.0;

double LogSum(double a, double b) {
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

}  // namespace

DriftStrength::DriftStrength(const VgdOptions& options) : options_(options) {
  for (const double factor : kFactors) {
    candidates_.push_back(factor * options.process.tilt);
    const double z = std::log(factor) / kPriorSpread;
    log_probability_.push_back(-0.5 * z * z);
  }
}

DriftStrength::Fit DriftStrength::Solve(const FlightData& flight, const WindowData& data,
                                        double tilt) {
  options_.process.tilt = tilt;
  WindowProblem problem(flight.track, data, options_);
  const std::span<const Pass> path = data.offsets.empty() ? data.passes : data.passes.first(1);
  problem.SetStart(PriorMeans(options_), RoughPath(flight.log.fixes, path));
  const double cost = problem.Solve().final_cost;
  return {cost, problem.LogEvidence()};
}

void DriftStrength::Learn(const FlightData& flight, int tau) {
  if (tau % kPasses != 0 || !flight.HasArc(tau - 1)) return;
  WindowData data = CutWindow(flight, options_, tau - kPasses, tau, false);
  std::vector<double> evidence;
  double least_cost = std::numeric_limits<double>::infinity();
  for (const double candidate : candidates_) {
    const Fit fit = Solve(flight, data, candidate);
    least_cost = std::min(least_cost, fit.cost);
    evidence.push_back(fit.log_evidence);
  }
  // Where no drift makes the two passes fit together, the fixes are false; such a pair would shout
  // down all others. (A cost is half a sum of squares of about one for each residual.)
  const double residuals = 3.0 * data.fixes.size() + 2.0 * data.forces.size();
  if (least_cost > 0.5 * kMisfit * residuals) return;
  const double best = *std::max_element(evidence.begin(), evidence.end());
  // Which of the two is the false one makes no difference to the drift.
  data.offsets = {{kPasses - 1, kFalseOffset, kFalseOffsetRate}};
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (evidence[i] < best - kDoubt) {
      const double if_false = Solve(flight, data, candidates_[i]).log_evidence + kLogFalse;
      evidence[i] = LogSum(evidence[i], if_false);
    }
    log_probability_[i] += evidence[i];
  }
}

double DriftStrength::Tilt() const {
  const auto best = std::max_element(log_probability_.begin(), log_probability_.end());
  return candidates_[best - log_probability_.begin()];
}

std::vector<double> LearnTilts(const FlightData& flight, const VgdOptions& options) {
  std::vector<double> tilts(flight.passes.size(), options.process.tilt);
  if (!options.adapt_drift || options.process.tilt <= 0.0) return tilts;
  DriftStrength drift(options);
  for (std::size_t i = 0; i < tilts.size(); ++i) {
    drift.Learn(flight, static_cast<int>(i) + 1);
    tilts[i] = drift.Tilt();
  }
  return tilts;
}

}  // namespace trueline
