// Residuals that depend on the unknowns directly, without an integration.
#pragma once

#include <Eigen/Core>

#include "cost_functions/chain_node.h"

namespace trueline {

// The step of theta from one section of a flight to the next: biases and the AHRS error do a random
// walk, the airframe's parameters are constant.
//
//   error:      next - theta, in units of theta's prior sigma
//   weighting:  one over the sigma of each step; zero removes the coupling
struct ParameterStepError {
  Eigen::Matrix<double, kThetaSize, 1> weight;

  template <class T>
  bool operator()(const T* theta, const T* next, T* r) const {
    for (int i = 0; i < kThetaSize; ++i) r[i] = weight[i] * (next[i] - theta[i]);
    return true;
  }
};

// The marginalised past of a window as a prior on its first unknowns.
//
//   error:      (theta, node) - mean
//   weighting:  sqrt_information, square
struct PastError {
  Eigen::VectorXd mean;
  Eigen::MatrixXd sqrt_information;

  template <class T>
  bool operator()(const T* theta, const T* node, T* r) const {
    Eigen::Matrix<T, Eigen::Dynamic, 1> error(mean.size());
    for (Eigen::Index i = 0; i < mean.size(); ++i) {
      error[i] = (i < kThetaSize ? theta[i] : node[i - kThetaSize]) - mean[i];
    }
    Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, 1>>(r, mean.size()) =
        sqrt_information.cast<T>() * error;
    return true;
  }
};

}  // namespace trueline
