// What the fits of the benchmarks' numbers share.
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <Eigen/Dense>
#include <map>
#include <memory>
#include <vector>

#include "problems/common/error.h"
#include "problems/prediction/fit_prediction.h"

namespace trueline {

// A residual of the free numbers, differentiated in the scalar that effects are kept for.
template <class Residual>
std::unique_ptr<ceres::CostFunction> CostOf(const Residual& residual, int numbers, int residuals) {
  auto cost =
      std::make_unique<ceres::DynamicAutoDiffCostFunction<Residual, 4>>(new Residual(residual));
  cost->AddParameterBlock(numbers);
  cost->SetNumResiduals(residuals);
  return cost;
}

// Solves in silence. Throws InputError if Ceres gives no usable solution: the start values must not
// pass for a result.
inline ceres::Solver::Summary SolveSilently(ceres::Solver::Options options,
                                            ceres::Problem* problem) {
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem, &summary);
  if (!summary.IsSolutionUsable()) {
    throw InputError("the fit of the numbers failed: " + summary.message +
                     "; are the start values under `numbers` those of such a vehicle?");
  }
  return summary;
}

// Adds the gradient and the curvature of weight * |e|, smooth below `smooth`, where e has the
// Jacobian J.
template <class Error, class Jacobian, class Vector, class Matrix>
void AddNorm(const Error& e, const Jacobian& J, double weight, double smooth, Vector* gradient,
             Matrix* curvature) {
  const double norm = std::hypot(e.norm(), smooth);
  const Vector pull = J.transpose() * e / norm;
  *gradient += weight * pull;
  *curvature += weight / norm * (J.transpose() * J - pull * pull.transpose());
}

// Spread of a fit's numbers by the spread of gradients between clusters (Huber-White sandwich),
// for errors that are correlated within a run or a section of flight.
class ClusterVariance {
 public:
  explicit ClusterVariance(int size) : curvature_(Eigen::MatrixXd::Zero(size, size)) {}

  // Gradient and curvature of the cost of one observation.
  void Add(int cluster, const Eigen::VectorXd& gradient, const Eigen::MatrixXd& curvature) {
    curvature_ += curvature;
    gradients_.try_emplace(cluster, Eigen::VectorXd::Zero(gradient.size())).first->second +=
        gradient;
  }

  // Standard deviation of every number, zero where there is one cluster only; with the small-sample
  // factor n / (n - 1).
  Eigen::VectorXd Sigmas() const {
    const double n = static_cast<double>(gradients_.size());
    Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(curvature_.rows(), curvature_.cols());
    if (n < 2.0) return middle.diagonal();
    for (const auto& [cluster, gradient] : gradients_) middle += gradient * gradient.transpose();
    const Eigen::MatrixXd inverse = curvature_.inverse();
    return (n / (n - 1.0) * inverse * middle * inverse).diagonal().cwiseSqrt();
  }

 private:
  Eigen::MatrixXd curvature_;
  std::map<int, Eigen::VectorXd> gradients_;
};

}  // namespace trueline
