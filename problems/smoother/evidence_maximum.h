// The maximum of a log probability in a few unknowns and its curvature, from function values only.
#pragma once

#include <Eigen/Dense>
#include <functional>

namespace trueline {

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
