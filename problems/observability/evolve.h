// Minimises a function without derivatives that has kinks where limits are active: an evolution
// strategy with a diagonal covariance (sep-CMA-ES, Ros and Hansen 2008). A trust region in 29
// unknowns (BOBYQA) stops at such a kink.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace trueline {

struct EvolveOptions {
  int evaluations = 1800;
  double step = 0.1;  // of the first generation, in the units given
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all cores; the result does not depend on it
  std::function<void(int tried, double best)> watch = nullptr;  // called after each tenth
};

struct Evolved {
  Eigen::VectorXd x;  // the best of all that were tried, the start included
  double value = 0.0;
};

// `unit`: scale of each coordinate. `cost` may be infinite for infeasible x.
Evolved Evolve(const std::function<double(const Eigen::VectorXd&)>& cost,
               const Eigen::VectorXd& start, const Eigen::VectorXd& unit,
               const EvolveOptions& options);

}  // namespace trueline
