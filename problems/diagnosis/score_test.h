// The test of one effect against a solved flight: theta, nuisances, all segments' unknowns and the
// effects already found are projected out.
#pragma once

#include <functional>

#include "problems/diagnosis/base_fit.h"

namespace trueline {

// An effect's estimate by one linear step, and the evidence that it is more than ordinary: a size
// that every vehicle has is no cause, however well a long flight shows it.
struct ScoreTest {
  Eigen::VectorXd value;  // step from where the columns stand, by parameter
  Eigen::VectorXd
      sigma;  // the larger of the noise model's and that of the scatter between clusters
  Eigen::MatrixXd cov_model, cov_cluster;  // of the value plus an ordinary size
  double chi2 = 0.0;                       // by the noise model, all parameters jointly
  double chi2_cluster = 0.0;               // by the scatter between clusters
  double p_model = 1.0;                    // of chi2
  double p_cluster = 1.0;                  // F, few clusters allowed for

  double p() const { return p_model > p_cluster ? p_model : p_cluster; }
  double z() const;
  // Judges a value in place of the step.
  void Judge(const Eigen::VectorXd& whole_value, int clusters);
  // The noise model's chi-square is at most `gain`, twice what the likelihood gained.
  void LimitTo(double gain);
};

// A linearised flight with its states eliminated: 1/2 z'Mz + b'z over its border unknowns z, and
// what ChainSystem::ClusterProducts gives.
struct TestedSystem {
  const Eigen::MatrixXd& M;
  const Eigen::VectorXd& b;
  std::function<Eigen::MatrixXd(const Eigen::VectorXd&, const Eigen::MatrixXd&)> cluster_products;
};

// `system` holds all columns; nuisances: how many of its border unknowns are projected out (they
// come first), candidate: where the effect's columns stand in the border; `ordinary` sizes, one for
// each of them.
ScoreTest TestColumns(const TestedSystem& system, int nuisances, int candidate,
                      const Eigen::VectorXd& ordinary);
ScoreTest TestColumns(const ChainSystem& system, int nuisances, int candidate,
                      const Eigen::VectorXd& ordinary);

// Sizes, by parameter, that would have been found with 95 % power at level `alpha`.
Eigen::VectorXd DetectableSize(const ScoreTest& test, double alpha, int clusters);

}  // namespace trueline
