// The information of a flight on the constants, all states marginalised: nodes are eliminated one
// by one along the chain, in blocks, so the cost grows with the flight's length only.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "problems/rotor_data/rotor_state.h"

namespace trueline {

class ConstantsInformation {
 public:
  // `free`: indices of the constants that are unknown, `scale`: their unit (prior sigma).
  ConstantsInformation(std::vector<int> free, const RotorConstants& scale);

  // Whitened Jacobians of what ties the current node to the constants.
  void AddAtNode(const Eigen::MatrixXd& d_node, const Eigen::MatrixXd& d_constants);
  // What ties the current node to the next; the current one is then eliminated.
  void StepToNext(const Eigen::MatrixXd& d_node, const Eigen::MatrixXd& d_next,
                  const Eigen::MatrixXd& d_constants);
  // Information on the free constants in units of `scale`, the last node marginalised. Ends it.
  Eigen::MatrixXd Finish();
  // log of the determinant of all that was eliminated, after Finish.
  double log_determinant() const { return log_determinant_; }

 private:
  Eigen::MatrixXd Scaled(const Eigen::MatrixXd& d_constants) const;

  std::vector<int> free_;
  RotorConstants scale_;
  Eigen::MatrixXd information_;  // of (current node, free constants)
  double log_determinant_ = 0.0;
};

}  // namespace trueline
