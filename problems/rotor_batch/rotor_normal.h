// The batch linearised at its solution: normal equations of the constants and of candidate effects,
// all states eliminated, stored by cluster of time. Residuals of real flights are correlated in
// time, so evidence and intervals also use the scatter of scores between clusters.
#pragma once

#include <functional>
#include <vector>

#include "problems/rotor_batch/rotor_batch.h"
#include "problems/rotor_batch/segment.h"

namespace trueline {

// Effects that a model may lack, one column each: forces along the flight, and errors of pose
// readings.
struct RotorColumns {
  // Error of the pose read at a node, for each unit of size: position [m], then rotation in body
  // axes [rad]: 6 x columns.
  using ReadFunction = std::function<void(double t, const RotorState& x, Eigen::MatrixXd* read)>;

  int count = 0;
  SegmentModel::PushFunction push;
  ReadFunction read = nullptr;  // null where no column changes pose readings directly
};

// Border unknowns z: the free constants in units of their prior sigma, then the columns' sizes.
class RotorNormal {
 public:
  // `cluster`: length of a cluster, s.
  RotorNormal(const RotorAeroModel& model, const RotorData& data, const RotorBatchOptions& options,
              const RotorBatchResult& batch, const RotorColumns& columns, double cluster);

  // The cost is 1/2 z'Mz + b'z + const, minimised over the states, priors of the constants
  // included.
  const Eigen::MatrixXd& M() const { return M_; }
  const Eigen::VectorXd& b() const { return b_; }
  int border() const { return static_cast<int>(b_.size()); }
  int constants() const { return static_cast<int>(free_.size()); }
  int clusters() const { return static_cast<int>(grams_.size()); }
  // For each cluster the sum over its rows of e_i v_i: e are the whitened residuals at the border
  // values `e` (border() + 1 numbers, the last one multiplies the residual), v those at each column
  // of `v`.
  Eigen::MatrixXd ClusterProducts(const Eigen::VectorXd& e, const Eigen::MatrixXd& v) const;
  // The same system from the given clusters only. M contains the priors once.
  RotorNormal Only(const std::vector<bool>& used) const;
  // The same system with the constants and the given columns only (counted from 0), in that order.
  RotorNormal Select(const std::vector<int>& columns) const;

  // Covariance of the constants (kConstants x kConstants, SI) from noise and prior, all columns
  // held at zero. For a flight linearised at the truth this is the Bayesian Cramer-Rao bound (Van
  // Trees).
  Eigen::MatrixXd NoiseCovariance() const;
  // The same from the observed scatter of scores between clusters (sandwich estimator).
  Eigen::MatrixXd ClusterCovariance() const;
  // What the columns, each a consider parameter of sigma 1, add to these covariances.
  Eigen::MatrixXd ColumnCovariance() const;

 private:
  struct Link;
  // Converts a matrix of the free constants in prior sigmas to one of all constants in SI.
  Eigen::MatrixXd InUnits(const Eigen::MatrixXd& scaled) const;
  void Eliminate(std::vector<Link>* links) const;
  void Sum();

  std::vector<int> free_;
  RotorConstants scale_;
  Eigen::VectorXd prior_error_;         // of the free constants, in prior sigmas
  std::vector<Eigen::MatrixXd> grams_;  // by cluster, border() + 1 squared
  Eigen::MatrixXd M_;
  Eigen::VectorXd b_;
};

// For each constant the ratio of the sigma from scatter between clusters to the sigma from noise,
// at least 1; 1 for known constants. An unmodelled smooth disturbance such as drag is not white:
// its scores add up within a cluster where those of noise cancel.
RotorConstants WideningFactors(const RotorAeroModel& model, const RotorData& data,
                               const RotorBatchOptions& options, const RotorBatchResult& batch);

}  // namespace trueline
