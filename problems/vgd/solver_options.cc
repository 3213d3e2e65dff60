#include "problems/vgd/solver_options.h"

#include <algorithm>
#include <memory>

#include "cost_functions/huber.h"

namespace trueline {
namespace {

double ParameterTolerance(const VgdOptions& options) {
  return std::max(1e-12, 1e-6 * options.tolerance);
}

}  // namespace

ceres::Problem::Options ProblemOptions(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.evaluation_callback = callback;
  return options;
}

ceres::Solver::Options SolverOptions(const VgdOptions& options,
                                     ceres::LinearSolverType linear_solver) {
  ceres::Solver::Options result;
  result.max_num_iterations = options.max_iterations;
  result.function_tolerance = options.tolerance;
  result.gradient_tolerance = 1e-12;
  result.parameter_tolerance = ParameterTolerance(options);
  result.logging_type = ceres::SILENT;
  if (options.solver != VgdSolver::kTrustRegion) {
    result.minimizer_type = ceres::LINE_SEARCH;
    result.line_search_direction_type =
        options.solver == VgdSolver::kBfgs ? ceres::BFGS : ceres::STEEPEST_DESCENT;
    return result;
  }
  result.linear_solver_type = linear_solver;
  // Steps are clipped to the bounds; a line search on top would double the cost of each.
  result.max_num_line_search_step_size_iterations = 0;
  // Weakly observable directions form a narrow, curved valley; following it needs steps that raise
  // the cost.
  result.use_nonmonotonic_steps = true;
  return result;
}

TrustRegionOptions TrustRegion(const VgdOptions& options) {
  const ceres::Solver::Options defaults;
  return {.max_iterations = options.max_iterations,
          .tolerance = options.tolerance,
          .parameter_tolerance = ParameterTolerance(options),
          .radius = defaults.initial_trust_region_radius,
          .nonmonotonic_steps = defaults.max_consecutive_nonmonotonic_steps};
}

ceres::LossFunction* MakeLoss(FixLoss loss, double scale) {
  switch (loss) {
    case FixLoss::kHuber:
      return new ceres::HuberLoss(scale);
    case FixLoss::kCauchy:
      return new ceres::CauchyLoss(scale);
    case FixLoss::kNorm:
      return new NormLoss();
    case FixLoss::kNone:
      break;
  }
  return nullptr;
}

double RobustWeight(FixLoss loss, double scale, double norm) {
  const std::unique_ptr<const ceres::LossFunction> function(MakeLoss(loss, scale));
  if (!function) return 1.0;
  double rho[3];
  function->Evaluate(norm * norm, rho);
  return rho[1];
}

}  // namespace trueline
