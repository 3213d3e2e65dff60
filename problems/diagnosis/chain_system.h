// The linearised flight as a chain of segments with a border. The normal equations of the segments'
// unknowns are block-tridiagonal and are eliminated onto the border (theta, effect parameters, the
// residual). One elimination serves all candidates and takes a few milliseconds.
#pragma once

#include <vector>

#include "problems/diagnosis/chain_stacks.h"

namespace trueline {

// The cost after all segments' unknowns are eliminated: 1/2 z'Mz + b'z + rss/2 over the border
// unknowns z = (theta, columns), priors included.
struct Reduced {
  Eigen::MatrixXd M;
  Eigen::VectorXd b;
  double rss = 0.0;          // of the residual alone, segments' unknowns at their best
  double log_det = 0.0;      // of the segments' part of the normal matrix
  double log_weights = 0.0;  // sum of the log determinants of the rows' whitening
};

// Adds the priors of theta and columns to the eliminated border.
Reduced Reduce(const LinearFlight& linear, const ChainElimination& elimination, double log_weights);

// Log marginal likelihood up to a constant that does not depend on the strengths: the first
// `nuisances` border unknowns are integrated out, the others are at their optimum.
double LogEvidence(const Reduced& reduced, int nuisances);

class ChainSystem {
 public:
  // All that `linear` refers to must outlive this object.
  ChainSystem(const LinearFlight& linear, const NoiseStrengths& noise);

  const Reduced& reduced() const { return reduced_; }
  int border() const { return static_cast<int>(reduced_.b.size()); }

  // The segments' unknowns that minimise the cost at the given border values (border() + 1 rows;
  // the last one multiplies the residual), one column each: kNodeSize rows for each segment.
  std::vector<Eigen::MatrixXd> NodesFor(const Eigen::MatrixXd& border_values) const;

  // For each cluster the sum over its rows of e_i v_i: e are the whitened residuals at the border
  // values `e` (border() + 1 numbers), v those at each column of `v`. Clusters x columns of v.
  Eigen::MatrixXd ClusterProducts(const Eigen::VectorXd& e, const Eigen::MatrixXd& v) const;

  // Whitened residuals of the measurement rows for border values `e`.
  Eigen::VectorXd Whitened(const Eigen::VectorXd& e) const;

 private:
  // Whitened rows of a segment for given border values and nodes.
  Eigen::MatrixXd RowsFor(int s, const Eigen::MatrixXd& border_values,
                          const std::vector<Eigen::MatrixXd>& nodes) const;

  const BaseFlight& flight_;
  std::vector<RowStack> stacks_;
  std::vector<EliminatedSegment> eliminated_;
  Reduced reduced_;
};

}  // namespace trueline
