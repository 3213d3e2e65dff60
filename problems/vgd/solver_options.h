// How windows are solved.
#pragma once

#include <ceres/solver.h>

#include "problems/vgd/vgd_options.h"

namespace trueline {

// Ceres' options for the solver that `options` name, stopping as in eq. 36 of Li et al. 2019;
// `linear_solver` counts for the trust region only.
ceres::Solver::Options SolverOptions(const VgdOptions& options,
                                     ceres::LinearSolverType linear_solver);

}  // namespace trueline
