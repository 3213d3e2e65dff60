// The test of one effect against a solved flight: theta, nuisances, all segments' unknowns and the
// effects already found are projected out.
#pragma once

#include <algorithm>
#include <cmath>

#include "problems/diagnosis/base_fit.h"

namespace trueline {

// An effect's estimate by one linear step, and the evidence for it.
struct ScoreTest {
  Eigen::VectorXd value;  // step from where the columns stand, by parameter
  Eigen::VectorXd sigma;  // the larger of the model's own and that of the scatter between clusters
  double chi2 = 0.0;      // by the noise model, all parameters jointly
  double p_model = 1.0;   // of chi2
  double p_cluster = 1.0;  // by the scatter between clusters: F, few clusters allowed for
  Eigen::MatrixXd information;  // of the parameters, everything else projected out
  double inflation = 1.0;  // variance between clusters over that of the noise model, 1 or more

  double p() const { return std::max(p_model, p_cluster); }
  double z() const { return std::sqrt(chi2 / inflation); }
};

// `system` holds all columns; nuisances: how many of its border unknowns are projected out (they
// come first), candidate: where the effect's columns stand in the border, and how many they are.
ScoreTest TestColumns(const ChainSystem& system, int nuisances, int candidate, int size);

// Sizes, by parameter, that would have been found with 95 % power at level `alpha`.
Eigen::VectorXd DetectableSize(const ScoreTest& test, double alpha, int clusters);

}  // namespace trueline
