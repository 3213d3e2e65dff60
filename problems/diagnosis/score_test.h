// Score test of an effect against a fitted flight, with nuisance columns projected out. Residuals
// of real flights are correlated in time, so the test uses the less certain of two variances: that
// of the noise model, and that of the scatter of scores between clusters of time.
#pragma once

#include "problems/diagnosis/candidate.h"
#include "problems/diagnosis/linearisation.h"

namespace trueline {

// The estimate of columns by one linear step.
struct LinearEstimate {
  Eigen::VectorXd value;  // step from the columns' current value
  Eigen::MatrixXd cov;    // of the noise model
  double gain = 0.0;      // twice the increase of the log likelihood
};
LinearEstimate Estimate(const Linearisation& fit, const std::vector<int>& nuisances,
                        const std::vector<int>& tested);

// The share of a column's information that is left beside the nuisances, 0 to 1: how little of it
// they imitate.
double OwnShare(const Linearisation& fit, const std::vector<int>& nuisances, int column);

// Covariance that an error of the model adds to the tested columns' values: an error like the
// columns `alike`, of a random direction among them and of unit gain.
Eigen::MatrixXd ImitatedBy(const Linearisation& fit, const std::vector<int>& nuisances,
                           const std::vector<int>& tested, const std::vector<int>& alike);

// What a value that is moved by `moved` errs by beyond the `chance` (variances) of such a move.
Eigen::VectorXd BeyondChance(const Eigen::VectorXd& moved, const Eigen::VectorXd& chance);

// An estimate, and the evidence that it exceeds ordinary sizes. Effects below `ordinary` are not
// reported, at any significance.
struct ScoreTest {
  Eigen::VectorXd value;  // step from the columns' current value
  Eigen::VectorXd sigma;  // the larger of the noise model's and the scatter's between clusters
  Eigen::MatrixXd cov_model, cov_cluster;  // of the value plus an ordinary size
  double gain = 0.0;                       // as LinearEstimate's
  double chi2 = 0.0;                       // by the noise model, all parameters jointly
  double chi2_cluster = 0.0;               // by the scatter between clusters
  double p_model = 1.0;                    // of chi2
  double p_cluster = 1.0;                  // F, few clusters allowed for
  // Of each cluster about each of the columns, nuisances allowed for; empty if there are no
  // clusters.
  Eigen::MatrixXd information;
  Eigen::MatrixXd scores;  // by cluster, of the fit with the columns at their estimate

  double p() const { return p_model > p_cluster ? p_model : p_cluster; }
  double z() const;
  // Judges this value instead of the step.
  void Judge(const Eigen::VectorXd& whole_value);
  // How many clusters share the information about an effect of this size; infinite where there are
  // no clusters.
  double Sharing(const Eigen::VectorXd& size) const;
  // Of the scatter between the clusters that share it (Bell and McCaffrey 2002), and of a prior
  // (Smyth 2004). On 12 of 13 measured flights the scatter of all effects is 0.8 to 1.1 times the
  // noise model's, few clusters allowed for, which would admit twenty. A misfit of one manoeuvre is
  // no scatter, so that four are taken: with eight, drag changed on a throw where it did not.
  double DegreesOfFreedom(const Eigen::VectorXd& size) const;
  // Limits the noise model's chi-square to `gain`, twice the increase of the log likelihood.
  void LimitTo(double gain);
  // Widens the value's errors by how far it moves beside further nuisances, beyond what their own
  // errors move it by (Hausman 1978).
  void Widen(const ScoreTest& beside);
  // Converts from units of columns to those of parameters.
  void Scale(const Eigen::VectorXd& unit);
};

// `ordinary`: a size for each of the tested columns.
ScoreTest TestColumns(const Linearisation& fit, const std::vector<int>& nuisances,
                      const std::vector<int>& tested, const Eigen::VectorXd& ordinary);

// Tests the whole value of a cause in the model against the model without it, the other causes
// kept. `beside`: further nuisance columns, which may explain the residual as well.
ScoreTest TestFound(const Linearisation& fit, const std::vector<Found>& found, std::size_t which,
                    const std::vector<int>& beside = {});

// Sizes, by column, that the test finds with 95 % power at level `alpha`, whichever of the errors
// of the model, by their covariances, adds to the value.
Eigen::VectorXd DetectableSize(const ScoreTest& test, double alpha,
                               const std::vector<Eigen::MatrixXd>& errors = {});

}  // namespace trueline
