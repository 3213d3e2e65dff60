// The score that a design maximises, and its gradient with respect to the control points.
//
// Forward: E2LOG of each segment (W_k, Phi_k), chained backwards, V_k = W_k + Phi_k' V_{k+1} Phi_k;
// V_0 is the Gramian. Backward: with G_0 = d score / d V_0 and G_{k+1} = Phi_k G_k Phi_k', the
// score changes by <G_k, dW_k> + <2 V_{k+1} Phi_k G_k, dPhi_k>. Reverse mode propagates that to
// each segment's few Taylor coefficients. The cost does not depend on the number of control points.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "cost_functions/numbers/taylor.h"
#include "problems/observability/rotor_driven_system.h"
#include "problems/observability/variable.h"
#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/limits.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

// Taylor coefficients of the flat outputs as independent variables on the tape.
template <int kOrder>
struct FlatVariables {
  Eigen::Matrix<Variable, kFlatOutputs, kOrder + 1> inputs;
  Vec4<Taylor<Variable, kOrder>> series;

  explicit FlatVariables(const FlatMatrix& expansion) {
    inputs = expansion.unaryExpr(&Variable::Independent);
    for (int i = 0; i < kFlatOutputs; ++i) {
      series[i] = Taylor<Variable, kOrder>::Start(inputs(i, 0));
      for (int j = 1; j <= kOrder; ++j) series[i].Append(inputs(i, j));
    }
  }
  // Their adjoints, given those of all entries.
  FlatMatrix Adjoints(const std::vector<double>& adjoints) const {
    FlatMatrix result(kFlatOutputs, kOrder + 1);
    for (int i = 0; i < kFlatOutputs; ++i) {
      for (int j = 0; j <= kOrder; ++j) result(i, j) = adjoints[inputs(i, j).entry()];
    }
    return result;
  }
};

struct DesignTarget {
  std::vector<int> interest;    // error states to be shown
  std::vector<int> asked;       // all unknown ones; those of no interest are marginalised
  std::vector<double> scale;    // usual standard deviation of each error state
  std::vector<double> weights;  // of the outputs
  double segment = 0.1;         // s, of E2LOG
};

// The target that shows `show` where these, `free` and the papers' other states are unknown,
// without its scale. Calls fail(key, text) for a name that is no constant. `by_noise` false:
// outputs count in their units, as published.
DesignTarget TargetOf(const RotorDrivenSystem& system, const std::vector<std::string>& show,
                      const std::vector<std::string>& free, bool by_noise,
                      const std::function<void(const char*, const std::string&)>& fail);

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

// How far a spline flight breaks its limits, smoothly, with the gradient: the mean over a grid of
// times of the squared excess of every limit, each as a share of its range.
class LimitPenalty {
 public:
  // `margin`: share of each limit that is kept free, so that the limits also hold between the
  // points of the grid. The travel limit is half to either side of the start.
  LimitPenalty(FlatVehicle vehicle, SplineShape shape, FlightLimits limits, double step,
               double margin);

  // For the free control points, 4 x num_free; zero where all limits hold.
  double Evaluate(const FlatMatrix& free, FlatMatrix* gradient) const;

 private:
  FlatVehicle vehicle_;
  SplineShape shape_;
  FlightLimits limits_;
  int per_piece_;
  double margin_;
};

}  // namespace trueline
