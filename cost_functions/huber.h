// Huber's loss of the norm of whitened residuals: squares up to `scale`, linear beyond.
#pragma once

#include <ceres/loss_function.h>

#include <cmath>

namespace trueline {

// The factor on the residuals' weight.
inline double HuberWeight(double scale, double norm) { return norm > scale ? scale / norm : 1.0; }

// Twice the cost.
inline double HuberCost(double scale, double norm) {
  return norm > scale ? scale * (2.0 * norm - scale) : norm * norm;
}

// The paper's own cost (Li et al. 2019, eq. 29): the sum of norms without squares.

// rho(s) = 2 (sqrt(s + e^2) - e), so that half of it is the norm for |r| >> e; e keeps the
// derivative finite at zero.
class NormLoss : public ceres::LossFunction {
 public:
  explicit NormLoss(double epsilon = 1e-3) : epsilon_(epsilon) {}

  void Evaluate(double s, double rho[3]) const override {
    const double root = std::sqrt(s + epsilon_ * epsilon_);
    rho[0] = 2.0 * (root - epsilon_);
    rho[1] = 1.0 / root;
    rho[2] = -0.5 / (root * root * root);
  }

 private:
  double epsilon_;
};

}  // namespace trueline
