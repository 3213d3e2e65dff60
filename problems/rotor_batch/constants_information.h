// The information of a flight on the constants, all states marginalised. Nodes are eliminated one
// by one along the chain, in blocks, so the cost is linear in the flight's length.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "problems/rotor_data/rotor_state.h"

namespace trueline {

class ConstantsInformation {
 public:
  // `free`: indices of the unknown constants; `scale`: the unit of each (prior sigma).
  ConstantsInformation(std::vector<int> free, const RotorConstants& scale);

  // Adds whitened Jacobians of residuals that depend on the current node and the constants.
  void AddAtNode(const Eigen::MatrixXd& d_node, const Eigen::MatrixXd& d_constants);
  // Adds residuals between the current node and the next, then eliminates the current node.
  void StepToNext(const Eigen::MatrixXd& d_node, const Eigen::MatrixXd& d_next,
                  const Eigen::MatrixXd& d_constants);
  // Marginalises the last node and returns the information on the free constants in units of
  // `scale`. Call it once, last.
  Eigen::MatrixXd Finish();
  // Sum of the log determinants of all eliminated blocks; valid after Finish.
  double log_determinant() const { return log_determinant_; }

 private:
  Eigen::MatrixXd Scaled(const Eigen::MatrixXd& d_constants) const;

  std::vector<int> free_;
  RotorConstants scale_;
  Eigen::MatrixXd information_;  // of (current node, free constants)
  double log_determinant_ = 0.0;
};

}  // namespace trueline
