// The linearised flight as a chain of segments with a border: block-tridiagonal normal equations of
// all segments' unknowns, eliminated onto the border (theta, effect parameters, the residual), so
// that one sweep serves every candidate at once and costs a few milliseconds.
#pragma once

#include <vector>

#include "problems/diagnosis/chain_stacks.h"

namespace trueline {

// What is left when all segments' unknowns are eliminated: 1/2 z'Mz + b'z + rss/2 over the border
// unknowns z = (theta, columns), priors included.
struct Reduced {
  Eigen::MatrixXd M;
  Eigen::VectorXd b;
  double rss = 0.0;          // of the residual alone, segments' unknowns at their best
  double log_det = 0.0;      // of the segments' part of the normal matrix
  double log_weights = 0.0;  // sum of the logarithms of what whitens the rows
};

// From the eliminated border, with the priors of theta and columns.
Reduced Reduce(const LinearFlight& linear, const ChainElimination& elimination, double log_weights);

// Logarithm of the marginal likelihood with the first `nuisances` border unknowns integrated out
// and the others at their best, up to a constant that no strength changes.
double LogEvidence(const Reduced& reduced, int nuisances);

class ChainSystem {
 public:
  // What `linear` points to must outlive this.
  ChainSystem(const LinearFlight& linear, const NoiseStrengths& noise);

  const Reduced& reduced() const { return reduced_; }
  int border() const { return static_cast<int>(reduced_.b.size()); }

  // The segments' unknowns that go with border values (border() + 1 rows; the last one multiplies
  // the residual), a column each: by segment, kNodeSize rows.
  std::vector<Eigen::MatrixXd> NodesFor(const Eigen::MatrixXd& border_values) const;

  // Sums over each cluster's rows of e_i v_i: e are the whitened residuals for border values `e`
  // (border() + 1), v those for each column of `v`. Clusters x columns of v.
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
