// What every ceres::Problem of this library needs beside its residuals.
#pragma once

#include <ceres/evaluation_callback.h>
#include <ceres/problem.h>

namespace trueline {

// Options of a problem whose residuals share an integration, which `callback` carries out once for
// each evaluation point.
ceres::Problem::Options ProblemOptions(ceres::EvaluationCallback* callback);

}  // namespace trueline
