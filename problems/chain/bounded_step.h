// The step of least quadratic cost between bounds.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace trueline {

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
