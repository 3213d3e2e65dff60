// Steps of Gauss-Newton on a chain, corrected by the step before. Where residuals are large, the
// cost may be more curved along some direction than Gauss-Newton knows, and its steps along that
// direction alternate. How the proposed step changed along the last one taken tells by how much:
// Anderson acceleration of depth one (Walker and Ni 2011, "Anderson acceleration for fixed-point
// iterations").
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace trueline {

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

}  // namespace trueline
