// The maximum of a log probability in a few unknowns, with its curvature, from values alone.
#pragma once

#include <Eigen/Dense>
#include <functional>

namespace trueline {

struct EvidenceMaximum {
  Eigen::VectorXd at;
  Eigen::MatrixXd cov;  // inverse of minus the curvature there (Laplace)
  int evaluations = 0;
};

// Newton steps on a parabola through points `reach` apart along each axis (which should be about a
// sigma), each step at most `longest` in every unknown. Where the curvature has the wrong sign its
// size is taken, so that a step always climbs.
EvidenceMaximum MaximiseEvidence(const std::function<double(const Eigen::VectorXd&)>& log_p,
                                 const Eigen::VectorXd& start, const Eigen::VectorXd& reach,
                                 double longest, int max_steps);

}  // namespace trueline
