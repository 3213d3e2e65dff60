// The linearised flight as a chain of segments with a border: block-tridiagonal normal equations of
// all segments' unknowns, eliminated onto the border (theta, effect parameters, the residual), so
// that one sweep serves every candidate at once and costs a few milliseconds.
#pragma once

#include <vector>

#include "problems/diagnosis/base_flight.h"

namespace trueline {

// How strong everything is that the model leaves out; learned from the flight (learn_noise.h).
struct NoiseStrengths {
  double fix_scale = 1.0;    // of the detector's own sigmas
  double force_sigma = 0.2;  // m/s^2, of a mean of the accelerometer's x or y, white part
  double gust = 0.05;        // m/s^2, stationary sigma of each horizontal axis
  double gust_memory = 0.8;  // s
  ProcessNoise process;      // white acceleration, drift of the AHRS error
};

// Effect parameters and other quantities that act on all rows linearly.
struct Columns {
  Eigen::MatrixXd d_rows;      // derivative of the rows of FlightRows, a column each
  Eigen::VectorXd precision;   // of a prior with mean zero; 0: none
  Eigen::VectorXd value;       // where the rows stand

  int count() const { return static_cast<int>(precision.size()); }
  static Columns None(int rows) { return {Eigen::MatrixXd(rows, 0), {}, {}}; }
  // These columns and then those of `more`.
  Columns With(const Columns& more) const;
};

// What is left when all segments' unknowns are eliminated: 1/2 z'Mz + b'z + rss/2 over the border
// unknowns z = (theta, columns).
struct Reduced {
  Eigen::MatrixXd M;
  Eigen::VectorXd b;
  double rss = 0.0;          // of the residual alone, segments' unknowns at their best
  double log_det = 0.0;      // of the segments' part of the normal matrix
  double log_weights = 0.0;  // sum of the logarithms of what whitens the rows
};

class ChainSystem {
 public:
  // `rows` with derivatives, at `x`. weight: by measurement row, the root of a robust weight. columns
  // may have no column. All must outlive this.
  ChainSystem(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
              const Eigen::VectorXd& weight, const Columns& columns, const NoiseStrengths& noise);

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
  // Whitened rows of one segment: what belongs to it, and its link to the next one.
  struct Stack {
    std::vector<int> row;      // of FlightRows; -1 for a link or a prior
    std::vector<int> cluster;  // by row
    FlightRows::RowMatrix node, next, border;
  };
  struct Eliminated {
    Eigen::Matrix<double, kNodeSize, kNodeSize> L;  // Cholesky factor
    Eigen::Matrix<double, kNodeSize, kNodeSize> next;
    Eigen::MatrixXd border;  // kNodeSize x (border + 1)
  };

  Stack StackOf(int s);
  void Measurements(int s, Stack* stack, int* at);
  void Link(int s, Stack* stack, int at);
  void StartPrior(int s, Stack* stack, int at);
  void Eliminate();
  // Whitened rows of a stack for given border values and nodes.
  Eigen::MatrixXd RowsFor(int s, const Eigen::MatrixXd& border_values,
                          const std::vector<Eigen::MatrixXd>& nodes) const;

  const BaseFlight& flight_;
  const FlightRows& rows_;
  const FlightUnknowns& x_;
  const Eigen::VectorXd& weight_;
  const Columns& columns_;
  NoiseStrengths noise_;
  std::vector<Stack> stacks_;
  std::vector<Eliminated> eliminated_;
  double log_weights_ = 0.0;
  Reduced reduced_;
};

// Logarithm of the marginal likelihood with the first `nuisances` border unknowns integrated out and
// the others at their best, up to a constant that no strength changes.
double LogEvidence(const Reduced& reduced, int nuisances);

}  // namespace trueline
