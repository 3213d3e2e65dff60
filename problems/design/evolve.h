// Minimises a function that has no derivatives and kinks where limits bind: an evolution strategy
// with a covariance of its own for each coordinate (sep-CMA-ES, Ros and Hansen 2008). A trust
// region in 29 unknowns (BOBYQA) stays at such a kink.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace trueline {

struct EvolveOptions {
  int evaluations = 1800;
  int offspring = 12;  // of a generation, evaluated in parallel
  double step = 0.1;   // of the first generation, in the units given
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all cores; the result does not depend on it
  std::function<void(int tried, double best)> watch = nullptr;  // called after each tenth
};

struct Evolved {
  Eigen::VectorXd x;  // the best of all that were tried, the start among them
  double value = 0.0;
};

// `unit`: scale of each coordinate. `cost` may be infinite where x is of no use.
Evolved Evolve(const std::function<double(const Eigen::VectorXd&)>& cost,
               const Eigen::VectorXd& start, const Eigen::VectorXd& unit,
               const EvolveOptions& options);

}  // namespace trueline
