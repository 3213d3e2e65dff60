// What the fits of the rotor-by-rotor model's numbers share: each number counts in its unit
// `typical`, held numbers do not move, and a fit that Ceres refuses is an error.
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <vector>

#include "problems/prediction/fit_prediction.h"

namespace trueline {

// Indices of the numbers that are not fitted.
std::vector<int> HeldNumbers(const std::vector<PredictionNumber>& numbers);
// SI values divided by their units, and back.
Eigen::VectorXd InUnits(const std::vector<double>& values,
                        const std::vector<PredictionNumber>& numbers);
std::vector<double> FromUnits(const Eigen::VectorXd& scaled,
                              const std::vector<PredictionNumber>& numbers);

// Solves in silence. Throws InputError if Ceres gives no usable solution: the start values must not
// pass for a result.
ceres::Solver::Summary SolveSilently(ceres::Solver::Options options, ceres::Problem* problem);

}  // namespace trueline
