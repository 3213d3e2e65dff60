// Huber's loss of the norm of whitened residuals: squares up to `scale`, linear beyond.
#pragma once

namespace trueline {

// The factor on the residuals' weight.
inline double HuberWeight(double scale, double norm) { return norm > scale ? scale / norm : 1.0; }

// Twice the cost.
inline double HuberCost(double scale, double norm) {
  return norm > scale ? scale * (2.0 * norm - scale) : norm * norm;
}

}  // namespace trueline
