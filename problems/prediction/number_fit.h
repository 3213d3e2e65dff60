// What the fits of the rotor-by-rotor model's numbers share: each number counts in its unit
// `typical`, held numbers do not move, and a fit that Ceres refuses is an error.
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <Eigen/Dense>
#include <map>
#include <vector>

#include "problems/common/error.h"
#include "problems/prediction/fit_prediction.h"

namespace trueline {

// Indices of the numbers that are not fitted.
inline std::vector<int> HeldNumbers(const std::vector<PredictionNumber>& numbers) {
  std::vector<int> held;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!numbers[i].free) held.push_back(static_cast<int>(i));
  }
  return held;
}

// SI values divided by their units, and back.
inline Eigen::VectorXd InUnits(const std::vector<double>& values,
                               const std::vector<PredictionNumber>& numbers) {
  Eigen::VectorXd scaled(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    scaled[static_cast<Eigen::Index>(i)] = values[i] / numbers[i].typical;
  }
  return scaled;
}
inline std::vector<double> FromUnits(const Eigen::VectorXd& scaled,
                                     const std::vector<PredictionNumber>& numbers) {
  std::vector<double> values(numbers.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = scaled[static_cast<Eigen::Index>(i)] * numbers[i].typical;
  }
  return values;
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

// Variances of a fit's numbers by the spread of gradients between clusters (Huber-White sandwich),
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

  // Variance of every number, zero for those in `held` and where there is one cluster only; with
  // the small-sample factor n / (n - 1).
  Eigen::VectorXd Diagonal(const std::vector<int>& held) const {
    const double n = static_cast<double>(gradients_.size());
    Eigen::MatrixXd curvature = curvature_;
    Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(curvature.rows(), curvature.cols());
    if (n < 2.0) return middle.diagonal();
    for (const auto& [cluster, gradient] : gradients_) middle += gradient * gradient.transpose();
    for (const int i : held) {
      curvature.row(i).setZero();
      curvature.col(i).setZero();
      curvature(i, i) = 1.0;
      middle.row(i).setZero();
      middle.col(i).setZero();
    }
    const Eigen::MatrixXd inverse = curvature.inverse();
    return (n / (n - 1.0) * inverse * middle * inverse).diagonal();
  }

 private:
  Eigen::MatrixXd curvature_;
  std::map<int, Eigen::VectorXd> gradients_;
};

}  // namespace trueline
