// How windows are solved, and the robust losses of their residuals.
#pragma once

#include <ceres/evaluation_callback.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "problems/chain/trust_region.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Options of a problem whose residuals share an integration, which `callback` carries out once for
// each evaluation point.
ceres::Problem::Options ProblemOptions(ceres::EvaluationCallback* callback);

// Ceres' options for the solver in `options`, with the stopping rule of Li et al. 2019, eq. 36;
// `linear_solver` applies to the trust region only.
ceres::Solver::Options SolverOptions(const VgdOptions& options,
                                     ceres::LinearSolverType linear_solver);

// The same trust region for a chain that solves itself.
TrustRegionOptions TrustRegion(const VgdOptions& options);

inline constexpr double kForceHuber = 2.5;  // sigmas, on the norm of a sample's x and y

// Each residual block needs its own instance and owns it; null for kNone. `scale` in sigmas.
ceres::LossFunction* MakeLoss(FixLoss loss, double scale);

// The loss's factor on the weight of a fix whose whitened residuals have this norm.
double RobustWeight(FixLoss loss, double scale, double norm);

}  // namespace trueline
