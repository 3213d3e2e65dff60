// Levenberg-Marquardt in a trust region, by the rules of Ceres' (Madsen et al. 2004; nonmonotonic
// steps after Conn et al. 2000, 10.1), for problems that assemble and solve their own steps.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace trueline {

struct TrustRegionOptions {
  int max_iterations = 50;
  double tolerance = 1e-4;            // relative change of the cost
  double parameter_tolerance = 1e-8;  // of the unknowns' norm
  double radius = 1e4;                // at the start
  // The cost may rise over this many steps in a row: weakly observable directions form a narrow,
  // curved valley. Zero: every step lowers the cost.
  int nonmonotonic_steps = 0;
};

struct TrustRegionResult {
  int iterations = 0;  // steps tried, the last and negligible one not counted
  bool converged = false;
  double cost = 0.0;  // at the best point, where the problem is left
};

// The quality of a step: its decrease of the cost over the predicted one, from the last point or
// from the highest of the last few, whichever is better.
class StepQuality {
 public:
  StepQuality(double cost, int nonmonotonic_steps)
      : most_(nonmonotonic_steps), least_(cost), cost_(cost), reference_(cost), candidate_(cost) {}

  double Of(double cost, double predicted) const {
    return std::max((cost_ - cost) / predicted,
                    (reference_ - cost) / (since_reference_ + predicted));
  }

  // True if no accepted point had a lower cost.
  bool Accept(double cost, double predicted) {
    cost_ = cost;
    since_candidate_ += predicted;
    since_reference_ += predicted;
    const bool best = cost < least_;
    rises_ = best ? 0 : rises_ + 1;
    if (best) least_ = cost;
    if (best || cost > candidate_) {
      candidate_ = cost;
      since_candidate_ = 0.0;
    }
    if (rises_ == most_) {
      reference_ = candidate_;
      since_reference_ = since_candidate_;
    }
    return best;
  }

 private:
  int most_, rises_ = 0;
  double least_, cost_, reference_, candidate_;           // costs
  double since_reference_ = 0.0, since_candidate_ = 0.0;  // predicted decreases since then
};

// The problem provides
//   double Linearise(double radius, double* cost): computes the step from the current point, damped
//       by the radius, and returns the decrease that it predicts; not positive: there is none;
//   double Try(): moves by the step and returns the cost there, infinite if there is none;
//   bool IsSmall(double tolerance) const: the step against the unknowns' norm;
//   void Return(): back to the linearisation point;
//   void Keep(), Restore(): the best point.
template <class Problem>
TrustRegionResult MinimiseInTrustRegion(Problem* problem, const TrustRegionOptions& options) {
  constexpr double kLeastQuality = 1e-3, kMostRadius = 1e16, kLeastRadius = 1e-32;
  constexpr int kMostInvalid = 5;  // steps in a row
  TrustRegionResult result;
  double radius = options.radius, shrink = 2.0, cost = 0.0;
  double predicted = problem->Linearise(radius, &cost);
  StepQuality quality(cost, options.nonmonotonic_steps);
  result.cost = cost;
  problem->Keep();
  if (!std::isfinite(cost)) return result;
  for (int invalid = 0; result.iterations < options.max_iterations;) {
    const bool valid = predicted > 0.0 && std::isfinite(predicted);
    invalid = valid ? 0 : invalid + 1;
    if (invalid > kMostInvalid || radius < kLeastRadius) break;
    double after = std::numeric_limits<double>::infinity();
    if (valid) {
      after = problem->Try();
      result.converged = problem->IsSmall(options.parameter_tolerance) ||
                         std::abs(cost - after) <= options.tolerance * cost;
      if (result.converged) break;
    }
    ++result.iterations;
    const double ratio = valid && std::isfinite(after) ? quality.Of(after, predicted) : -1.0;
    if (ratio > kLeastQuality) {
      cost = after;
      if (quality.Accept(after, predicted)) {
        result.cost = cost;
        problem->Keep();
      }
      radius /= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3));
      radius = std::min(radius, kMostRadius);
      shrink = 2.0;
    } else {
      if (valid) problem->Return();
      radius /= shrink;
      shrink *= 2.0;
    }
    if (result.iterations < options.max_iterations) predicted = problem->Linearise(radius, &cost);
  }
  problem->Restore();
  return result;
}

}  // namespace trueline
