// The batch linearised at its solution: normal equations of the constants and of what a model may
// lack, all states eliminated, kept by cluster of time. Residuals of real flights hang together in
// time, so that evidence and intervals are judged by the scatter between clusters as well.
#pragma once

#include <functional>
#include <vector>

#include "problems/rotor_batch/rotor_batch.h"
#include "problems/rotor_batch/segment.h"

namespace trueline {

// What a model may lack, a column each: pushes along the flight, and what poses read beyond it.
struct RotorColumns {
  // Of the pose at a node, by unit of size: position [m], then turn in body axes [rad]: 6 x
  // columns.
  using ReadFunction = std::function<void(double t, const RotorState& x, Eigen::MatrixXd* read)>;

  int count = 0;
  SegmentModel::PushFunction push;
  ReadFunction read = nullptr;  // null where poses read nothing but the flight
};

// Border unknowns z: the free constants in units of their prior sigma, then the columns' sizes.
class RotorNormal {
 public:
  // `cluster`: s.
  RotorNormal(const RotorAeroModel& model, const RotorData& data, const RotorBatchOptions& options,
              const RotorBatchResult& batch, const RotorColumns& columns, double cluster);

  // 1/2 z'Mz + b'z + const, states at their best, priors of the constants included.
  const Eigen::MatrixXd& M() const { return M_; }
  const Eigen::VectorXd& b() const { return b_; }
  int border() const { return static_cast<int>(b_.size()); }
  int constants() const { return static_cast<int>(free_.size()); }
  int clusters() const { return static_cast<int>(grams_.size()); }
  // Sum over each cluster's rows of e_i v_i, e the whitened residuals for border values `e`
  // (border() + 1, the last one multiplies the residual), v those for each column of `v`.
  Eigen::MatrixXd ClusterProducts(const Eigen::VectorXd& e, const Eigen::MatrixXd& v) const;
  // The same system with the given clusters alone. M holds the priors once.
  RotorNormal Only(const std::vector<bool>& used) const;
  // The same system with the given columns alone (from 0), in that order, behind the constants.
  RotorNormal Select(const std::vector<int>& columns) const;

  // Covariance of the constants (kConstants x kConstants, SI) by noise and prior; columns stay at
  // zero. Where the flight is linearised at the truth: the Bayesian Cramer-Rao bound (Van Trees).
  Eigen::MatrixXd NoiseCovariance() const;
  // The same where scores vary between clusters as they did, and not as the noise says (sandwich).
  Eigen::MatrixXd ClusterCovariance() const;
  // What columns' sizes, each of sigma 1 and not estimated, add to these.
  Eigen::MatrixXd ColumnCovariance() const;

 private:
  struct Link;
  // Of the free constants in prior sigmas, as a matrix of all constants in SI.
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

// By how much the sigma of each constant is larger by the scatter between clusters of time than by
// the noise; 1 where it is not, and for what is known. A disturbance that is smooth, as a drag that
// the model lacks, is no white noise: its scores add up where the noise's cancel.
RotorConstants WideningFactors(const RotorAeroModel& model, const RotorData& data,
                               const RotorBatchOptions& options, const RotorBatchResult& batch);

}  // namespace trueline
