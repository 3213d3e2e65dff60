// The score that a design maximises, and its gradient with respect to the control points.
//
// Forward: E2LOG of each segment (W_k, Phi_k), chained backwards, V_k = W_k + Phi_k' V_{k+1} Phi_k;
// V_0 is the Gramian. Backward: with G_0 = d score / d V_0 and G_{k+1} = Phi_k G_k Phi_k', the
// score changes by <G_k, dW_k> + <2 V_{k+1} Phi_k G_k, dPhi_k>. Reverse mode propagates that to
// each segment's few Taylor coefficients. The cost does not depend on the number of control points.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "problems/observability/rotor_driven_system.h"
#include "problems/trajectory/catalogue.h"

namespace trueline {

struct DesignTarget {
  std::vector<int> interest;    // error states to be shown
  std::vector<int> asked;       // all unknown ones; those of no interest are marginalised
  std::vector<double> scale;    // usual standard deviation of each error state
  std::vector<double> weights;  // of the outputs
  double segment = 0.1;         // s, of E2LOG
};

// Smooth approximation of the smallest eigenvalue of the scaled, marginalised Gramian: (sum
// lambda_i^-p)^(-1/p), p = 6, smaller by a factor of at most n^(1/p).
struct SoftMinimum {
  double log_value = 0.0;
  Eigen::MatrixXd gradient;  // d log_value / d gramian, size of the full Gramian
};
SoftMinimum LogSoftMinimum(const Eigen::MatrixXd& gramian, const DesignTarget& target);

class DesignScore {
 public:
  DesignScore(RotorDrivenSystem system, std::vector<double> parameters, SplineShape shape,
              DesignTarget target, int threads);

  // Log of the soft minimum at the free control points (4 x num_free, column by column), and its
  // gradient if `gradient` is not null. Minus infinity if the flight leaves the flat map's domain.
  double Evaluate(const FlatMatrix& free, FlatMatrix* gradient) const;

  const SplineShape& shape() const { return shape_; }

 private:
  RotorDrivenSystem system_;
  std::vector<double> parameters_;
  SplineShape shape_;
  DesignTarget target_;
  int threads_;
};

}  // namespace trueline
