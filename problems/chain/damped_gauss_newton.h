// Damped Gauss-Newton: steps of a linearised chain, shortened until they lower the cost.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

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

// Steps of Gauss-Newton on a chain, corrected by the step before. Where residuals are large, the
// cost may be more curved along some direction than Gauss-Newton knows, and its steps along that
// direction alternate. How the proposed step changed along the last one taken tells by how much:
// Anderson acceleration of depth one (Walker and Ni 2011, "Anderson acceleration for fixed-point
// iterations").

// Of the border's unknowns, and of each node's (kNode x 1).
struct ChainStep {
  Eigen::VectorXd border;
  std::vector<Eigen::MatrixXd> nodes;

  // this += factor step.
  void Add(double factor, const ChainStep& step) {
    border += factor * step.border;
    for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] += factor * step.nodes[i];
  }
};

class StepCorrector {
 public:
  // Forgets the last step, before another solve.
  void Reset() { last_.reset(); }
  // Sets the part of the last step that was taken.
  void SetPart(double part) { part_ = part; }
  // The step to take instead of `proposed`, which Gauss-Newton proposes now; none where the last
  // step tells nothing of this one. `hessian`: of the border, the nodes at their best; it measures
  // steps.
  std::optional<ChainStep> Correct(const Eigen::MatrixXd& hessian, const ChainStep& proposed) {
    const std::optional<Last> last = std::exchange(last_, Last{proposed, proposed});
    if (!last) return std::nullopt;
    ChainStep change = proposed;
    change.Add(-1.0, last->proposed);
    const Eigen::VectorXd weighed = hessian * change.border;
    const double share = weighed.dot(proposed.border) / weighed.dot(change.border);
    if (!(share > kLeast && share < kMost)) return std::nullopt;
    ChainStep step = proposed;
    change.Add(part_, last->step);
    step.Add(-share, change);
    return step;
  }
  // States that the corrected step is taken; otherwise the proposed one is.
  void UseCorrected(const ChainStep& corrected) { last_->step = corrected; }

 private:
  static constexpr double kLeast = -0.5, kMost = 0.9;  // of the correction

  struct Last {
    ChainStep proposed, step;
  };
  std::optional<Last> last_;
  double part_ = 1.0;
};

// The step of least quadratic cost between bounds.

// Minimises 1/2 z'Mz + b'z. Entries beyond their bounds are held there, and the others are the best
// beside them. Entries whose bounds are equal do not move. All vectors have the size of b.
inline Eigen::VectorXd BoundedStep(const Eigen::MatrixXd& M, const Eigen::VectorXd& b,
                                   const Eigen::VectorXd& lowest, const Eigen::VectorXd& highest) {
  Eigen::VectorXd step = Eigen::VectorXd::Zero(b.size()).cwiseMax(lowest).cwiseMin(highest);
  std::vector<int> open;
  for (int i = 0; i < static_cast<int>(b.size()); ++i) {
    if (lowest[i] < highest[i]) open.push_back(i);
  }
  const auto hold = [&](int i) {
    const bool beyond = step[i] < lowest[i] || step[i] > highest[i];
    if (beyond) step[i] = step[i] < lowest[i] ? lowest[i] : highest[i];
    return beyond;
  };
  bool held = true;
  while (held && !open.empty()) {
    step(open).setZero();
    const Eigen::VectorXd gradient = b + M * step;
    step(open) = -Eigen::MatrixXd(M(open, open)).ldlt().solve(Eigen::VectorXd(gradient(open)));
    held = std::erase_if(open, hold) > 0;
  }
  return step;
}

}  // namespace trueline
