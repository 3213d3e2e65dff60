// What the fits of the rotor-by-rotor model's numbers share: each number counts in its unit
// `typical`, held numbers do not move, and a fit that Ceres refuses is an error.
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <Eigen/Dense>
#include <map>
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
