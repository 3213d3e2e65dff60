// Damped Gauss-Newton: steps of a linearised chain, shortened until they lower the cost.
#pragma once

#include <algorithm>
#include <cmath>

namespace trueline {

struct DampedResult {
  int iterations = 0;      // linearisations
  bool converged = false;  // by the problem's criterion, or no part of a step lowers the cost
  double cost = 0.0;
};

// The problem provides
//   double Cost() const: at the current point;
//   double Linearise(): computes the step from the current point and returns the cost's slope along
//       it (negative);
//   bool Try(double part, double* cost): moves that part of the step away from the linearisation
//       point; false if the result is no valid point;
//   void Return(): back to the linearisation point;
//   bool IsSettled(double before, double after, double part) const: costs, and the accepted part.
// Where the cost is more curved than Gauss-Newton knows (large residuals), the whole step is too
// long; the part is then the minimum of a parabola through the values seen.
template <class Problem>
DampedResult MinimiseDamped(Problem* problem, int max_iterations) {
  constexpr double kLeast = 1e-3;      // part of a step
  constexpr double kSufficient = 0.3;  // decrease, of what the linearisation predicts
  constexpr double kFlat = 1e-10;      // slope, of the cost
  DampedResult result;
  result.cost = problem->Cost();
  while (result.iterations < max_iterations) {
    const double slope = problem->Linearise();
    ++result.iterations;
    if (-slope <= kFlat * result.cost) {
      result.converged = true;
      return result;
    }
    double part = 1.0, after = result.cost;
    bool lower = false;
    while (part >= kLeast && !lower) {
      const bool valid = problem->Try(part, &after) && std::isfinite(after);
      const double predicted = -slope * part * (1.0 - 0.5 * part);
      lower = valid && result.cost - after >= kSufficient * predicted;
      if (lower) break;
      const double bend = after - result.cost - slope * part;
      const double best = valid && bend > 0.0 ? -0.5 * slope * part * part / bend : 0.0;
      part = std::clamp(best, 0.1 * part, 0.5 * part);
    }
    if (!lower) {
      problem->Return();
      result.converged = std::isfinite(slope);
      return result;
    }
    const double before = result.cost;
    result.cost = after;
    if (problem->IsSettled(before, after, part)) {
      result.converged = true;
      return result;
    }
  }
  return result;
}

}  // namespace trueline
