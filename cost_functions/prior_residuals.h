// Residuals that depend on the unknowns directly, without an integration.
#pragma once

#include <Eigen/Core>
#include <array>

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
    return Whiten<T>({theta, node}, r);
  }
  template <class T>
  bool operator()(const T* theta, const T* node, const T* gust, T* r) const {
    return Whiten<T>({theta, node, gust}, r);
  }

 private:
  template <class T>
  bool Whiten(std::array<const T*, 3> blocks, T* r) const {
    constexpr int kFirst[] = {0, kThetaSize, kThetaSize + kGustAt, kThetaSize + kNodeSize};
    Eigen::Matrix<T, Eigen::Dynamic, 1> error = -mean.cast<T>();
    for (int b = 0; b < 3 && blocks[b] != nullptr; ++b) {
      for (int i = kFirst[b]; i < kFirst[b + 1]; ++i) error[i] += blocks[b][i - kFirst[b]];
    }
    Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, 1>>(r, mean.size()) =
        sqrt_information.cast<T>() * error;
    return true;
  }
};

}  // namespace trueline
