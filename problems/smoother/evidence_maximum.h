// The maximum of a log probability in a few unknowns and its curvature, from function values only.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

namespace trueline {

// A parabola through values of a log probability at `ParabolaOffsets` of a point.
struct EvidenceParabola {
  double middle;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd curvature;  // minus the second derivative, made positive definite

  Eigen::VectorXd Step() const { return curvature.ldlt().solve(gradient); }
  double Promises(const Eigen::VectorXd& step) const { return 0.5 * gradient.dot(step); }
};

// The point itself, one unit up and down each of `n` axes, then both up for each pair of axes.
// Without the pairs (the first 2n + 1), second derivatives by two unknowns are zero.
std::vector<Eigen::VectorXd> ParabolaOffsets(int n);
EvidenceParabola ParabolaThrough(const std::vector<double>& values, int n);

struct EvidenceMaximum {
  Eigen::VectorXd at;
  Eigen::MatrixXd cov;  // inverse of minus the curvature there (Laplace)
  int evaluations = 0;
  bool converged = false;  // else `max_steps` ended the search while steps were still large
};

// Newton steps on a parabola through points `reach` apart along each axis (choose about one sigma).
// Each step is at most `longest` in every unknown, and is halved while it descends. Negative
// curvatures are replaced by their magnitude, so every step ascends.
EvidenceMaximum MaximiseEvidence(const std::function<double(const Eigen::VectorXd&)>& log_p,
                                 const Eigen::VectorXd& start, const Eigen::VectorXd& reach,
                                 double longest, int max_steps);

}  // namespace trueline
