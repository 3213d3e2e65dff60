#include "problems/common/ceres_problem.h"

namespace trueline {

ceres::Problem::Options ProblemOptions(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.evaluation_callback = callback;
  return options;
}

}  // namespace trueline
