// Evaluation of an information matrix: which states the flight shows, how well, and one overall
// score.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "problems/observability/rank.h"

namespace trueline {

// Observable and unobservable states of one flight, with the Cramer-Rao bound.
struct Assessment {
  RankReport rank;            // numerical: of this flight
  std::vector<double> sigma;  // by position in rank.states, the state's unit; infinite where unseen
};

// `information` is Fisher's for all error states (SI units). Columns are scaled to unit diagonal. A
// direction whose eigenvalue is then below 1e-13 counts as unobservable, and the bound of its
// states is infinite rather than a large number made by rounding. A bound above 1,000 times the
// state's typical size is also infinite.
Assessment Assess(const Eigen::MatrixXd& information, const std::vector<int>& states,
                  const std::vector<StateInfo>& info);

// Sigmas of `interest`, which are among the states assessed.
std::vector<double> SigmasOf(const Assessment& assessment, const std::vector<int>& interest);

// Information on `kept` when `dropped` are unknown too: the Schur complement, with a pseudo-inverse
// where the dropped block is singular.
Eigen::MatrixXd SchurComplement(const Eigen::MatrixXd& information, const std::vector<int>& kept,
                                const std::vector<int>& dropped);

// Scores of a Gramian of the states of interest, columns scaled.
struct GramianScores {
  double sigma_min = 0.0;          // smallest singular value: the score of the papers (eq. 5)
  double condition = 0.0;          // largest over smallest; infinite where singular
  double log10_determinant = 0.0;  // minus infinity where singular
  std::vector<double> per_state;   // 1 / (inverse)_ii: what is left for each when all are unknown
};
GramianScores ScoreGramian(const Eigen::MatrixXd& gramian);

// Scores for `interest` out of `asked` states: columns scaled by `scale` (a usual standard
// deviation of each error state), all other asked states marginalised.
GramianScores ScoreStates(const Eigen::MatrixXd& gramian, const std::vector<int>& interest,
                          const std::vector<int>& asked, const std::vector<double>& scale);

// `asked` without `interest`.
std::vector<int> Others(const std::vector<int>& asked, const std::vector<int>& interest);

}  // namespace trueline
