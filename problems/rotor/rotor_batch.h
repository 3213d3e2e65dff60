// Batch calibration on the rotor-driven model: maximum a posteriori of all constants and of the
// states at all poses (multiple shooting), with white disturbances between poses. Solved by damped
// Gauss-Newton on the chain of nodes.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "cost_functions/huber.h"
#include "problems/common/error.h"
#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_state.h"
#include "problems/rotor/rotor_vehicle.h"

namespace trueline {

struct RotorBatchOptions {
  RotorNoise noise;
  RotorPrior prior;
  double robust_pose = 0.0;  // sigmas, scale of Huber's loss on each pose; 0: least squares
  int reweights = 1;         // times that weights are re-evaluated at the solution
  int max_iterations = 60;
  double negligible = 1e-3;  // of the cost; a solve that could still gain less ends. The estimate
                             // is then off by 0.05 of its sigmas at most
  bool covariance = true;    // else `cov` and `log_evidence` are not computed
  bool widen =
      false;  // intervals if residuals scatter more than the noise predicts (rotor_normal.h)

  // The factor on a pose's weight under Huber's loss, for a residual of this norm (sigmas).
  double PoseWeight(double norm) const {
    return robust_pose > 0.0 ? HuberWeight(robust_pose, norm) : 1.0;
  }
  // Twice its cost.
  double PoseCost(double norm) const {
    return robust_pose > 0.0 ? HuberCost(robust_pose, norm) : norm * norm;
  }
};

struct RotorBatchResult {
  RotorConstants mean;
  Eigen::MatrixXd cov;           // kConstants x kConstants, zero where known
  std::vector<RotorNode> nodes;  // at each pose
  bool converged = false;
  int iterations = 0;
  double cost = 0.0;          // half the sum of squared whitened residuals
  double log_evidence = 0.0;  // Laplace's approximation, up to a constant that depends on the data
                              // only
  int residuals = 0;
  double solve_time = 0.0;  // s
  // Of the constants by the noise alone, before intervals are widened; zero without `cov`.
  RotorConstants noise_sigma = RotorConstants::Zero();

  // Multiplies each constant's sigma.
  void Widen(const RotorConstants& factors) {
    cov = factors.asDiagonal() * cov * factors.asDiagonal();
  }
  RotorConstants Sigma() const { return cov.diagonal().cwiseMax(0.0).cwiseSqrt(); }
};

// What the weights of a solve are evaluated by: a model of the vehicle, and a solution. A cause's
// size changes the model, so where costs of several sizes are compared, one model gives the
// weights.
struct RotorWeights {
  const RotorAeroModel& model;
  const RotorData& data;
  const RotorBatchResult& at;
};

// `start`: a solution nearby to start from, or null; weights are evaluated by `weights`, or by the
// model at the start if that is null. Where the motors' unknowns are free, rotor speeds are
// recomputed from the commands as these unknowns change. A model that runs away from the flight
// between two poses has no weights: from a start its cost is then infinite. Throws InputError for
// such a model without a start, for an unphysical prior (mass or inertia), a prior that frees only
// some of I_x, I_y, I_z, or one that frees the motors' unknowns of a log without commands.
RotorBatchResult RunRotorBatch(const RotorAeroModel& model, const RotorData& data,
                               const RotorBatchOptions& options,
                               const RotorBatchResult* start = nullptr,
                               const RotorWeights* weights = nullptr);

// Says that a model has no weights at the best fit.
InputError RunsAway();

// Bayesian Cramer-Rao bound (Van Trees) of the constants at given states, one for each pose: the
// inverse of the information of data and prior, kConstants x kConstants.
Eigen::MatrixXd RotorBound(const RotorAeroModel& model, const RotorData& data,
                           const RotorBatchOptions& options, const std::vector<RotorNode>& nodes,
                           const RotorConstants& constants);

// Fits the batch to less smoothed speeds, and subtracts the bias that their noise causes. The bias
// is measured: speeds with noise of the same size, added and subtracted, move the constants by
// it on average (simulation extrapolation, Cook and Stefanski 1994, with antithetic pairs, which
// cancel what is linear in the noise). `batch` is the solution for `data`, which is returned where
// the speeds are exact or where a model without its bias would be no body. `bias`, if not null,
// becomes what was subtracted.
RotorBatchResult WithoutSpeedNoiseBias(const RotorAeroModel& model, const RotorData& data,
                                       const RotorBatchOptions& options,
                                       const RotorBatchResult& batch,
                                       RotorConstants* bias = nullptr);

}  // namespace trueline
