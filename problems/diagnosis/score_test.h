// Score test of one effect against a solved flight. Theta, nuisances, all segments' unknowns and
// the effects already found are projected out.
#pragma once

#include "problems/diagnosis/chain_system.h"

namespace trueline {

// An effect's estimate by one linear step, and the evidence that it exceeds ordinary sizes. Effects
// below `ordinary` are not reported, at any significance.
struct ScoreTest {
  Eigen::VectorXd value;  // step from the columns' current value, by parameter
  Eigen::VectorXd
      sigma;  // the larger of the noise model's and that of the scatter between clusters
  Eigen::MatrixXd cov_model, cov_cluster;  // of the value plus an ordinary size
  double chi2 = 0.0;                       // by the noise model, all parameters jointly
  double chi2_cluster = 0.0;               // by the scatter between clusters
  double p_model = 1.0;                    // of chi2
  double p_cluster = 1.0;                  // F, few clusters allowed for

  double p() const { return p_model > p_cluster ? p_model : p_cluster; }
  double z() const;
  // Judges this value instead of the step.
  void Judge(const Eigen::VectorXd& whole_value, int clusters);
  // Limits the noise model's chi-square to `gain`, twice the increase of the log likelihood.
  void LimitTo(double gain);
};

// `system` holds all columns. `nuisances`: number of leading border unknowns that are projected
// out. `candidate`: index of the effect's first column in the border. `ordinary`: one size for each
// of its columns.
ScoreTest TestColumns(const ReducedSystem& system, int nuisances, int candidate,
                      const Eigen::VectorXd& ordinary);

// Sizes, by parameter, that the test finds with 95 % power at level `alpha`.
Eigen::VectorXd DetectableSize(const ScoreTest& test, double alpha, int clusters);

}  // namespace trueline
