#include "problems/prediction/number_fit.h"

#include "problems/common/error.h"

namespace trueline {

std::vector<int> HeldNumbers(const std::vector<PredictionNumber>& numbers) {
  std::vector<int> held;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!numbers[i].free) held.push_back(static_cast<int>(i));
  }
  return held;
}

Eigen::VectorXd InUnits(const std::vector<double>& values,
                        const std::vector<PredictionNumber>& numbers) {
  Eigen::VectorXd scaled(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    scaled[static_cast<Eigen::Index>(i)] = values[i] / numbers[i].typical;
  }
  return scaled;
}

std::vector<double> FromUnits(const Eigen::VectorXd& scaled,
                              const std::vector<PredictionNumber>& numbers) {
  std::vector<double> values(numbers.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = scaled[static_cast<Eigen::Index>(i)] * numbers[i].typical;
  }
  return values;
}

ceres::Solver::Summary SolveSilently(ceres::Solver::Options options, ceres::Problem* problem) {
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem, &summary);
  if (!summary.IsSolutionUsable()) {
    throw InputError("the fit of the numbers failed: " + summary.message +
                     "; are the start values under `numbers` those of such a vehicle?");
  }
  return summary;
}

}  // namespace trueline
