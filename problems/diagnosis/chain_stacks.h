// Whitened rows of one segment of a flight's chain, and one step of its elimination.
#pragma once

#include <vector>

#include "problems/diagnosis/base_flight.h"

namespace trueline {

// Strengths of all noise and unmodelled processes; learned from the flight (LearnNoise).
struct NoiseStrengths {
  double fix_scale = 1.0;  // factor on the detector's stated sigmas
  // m/s^2, of a smoothed sample of the accelerometer's x or y, white part.
  double force_sigma = 0.1;
  ProcessNoise process;
};

// Effect parameters and other quantities that act linearly on all rows.
struct Columns {
  Eigen::MatrixXd d_rows;     // derivative of the rows of FlightRows, a column each
  Eigen::VectorXd precision;  // of a zero-mean prior; 0: no prior
  Eigen::VectorXd value;      // at the linearisation point

  int count() const { return static_cast<int>(precision.size()); }
  static Columns None(int rows) { return {Eigen::MatrixXd(rows, 0), {}, {}}; }
  // These columns and then those of `more`.
  Columns With(const Columns& more) const;
};

// A linearised flight: all inputs of whitening and elimination, by reference.
struct LinearFlight {
  const BaseFlight& flight;
  const FlightRows& rows;         // with derivatives
  const FlightUnknowns& x;        // where they were taken
  const Eigen::VectorXd& weight;  // by measurement row: root of the robust weight
  const Columns& columns;

  // theta, columns, residual.
  int width() const { return kThetaSize + columns.count() + 1; }
};

// Rows over a segment's own unknowns, the next segment's and the border (theta, columns, residual).
struct RowStack {
  std::vector<int> row;          // of FlightRows; -1 for links and priors
  std::vector<int> cluster;      // by row
  FlightRows::RowMatrix values;  // rows x (kNodeSize + kNodeSize + border)
  double log_weights = 0.0;      // sum of the logarithms of what whitens

  RowStack(int count, int border) : row(count, -1), cluster(count, 0) {
    values.setZero(count, 2 * kNodeSize + border);
  }
  auto node() { return values.leftCols<kNodeSize>(); }
  auto next() { return values.middleCols<kNodeSize>(kNodeSize); }
  auto border() { return values.rightCols(values.cols() - 2L * kNodeSize); }
};

// Fixes (or forces) of a segment, their sigmas times `scale`.
RowStack FixStack(const LinearFlight& linear, int segment, double scale);
RowStack ForceStack(const LinearFlight& linear, int segment, double sigma);
// The process rows from a segment to the next, if one follows: (p, v, drift) with the covariance
// that the processes accumulate, and the gust.
RowStack LinkStack(const LinearFlight& linear, int segment, const NoiseStrengths& noise);
// The prior on a stretch's first unknowns.
RowStack StartStack(const LinearFlight& linear, int segment, const NoiseStrengths& noise);
bool StartsStretch(const FlightPlan& plan, int segment);

// An eliminated segment: factors for back-substitution.
struct EliminatedSegment {
  Eigen::Matrix<double, kNodeSize, kNodeSize> L;  // Cholesky factor
  Eigen::Matrix<double, kNodeSize, kNodeSize> next;
  Eigen::MatrixXd border;  // kNodeSize x width
};

// Forward elimination over all segments in turn.
class ChainElimination {
 public:
  explicit ChainElimination(int width);
  // gram: values' * values of all rows of a segment. The factors are stored in `out` if it is not
  // null.
  void Add(const Eigen::MatrixXd& gram, EliminatedSegment* out);

  const Eigen::MatrixXd& border() const { return C_; }  // width x width
  double log_det() const { return log_det_; }

 private:
  int width_;
  Eigen::Matrix<double, kNodeSize, kNodeSize> D_;
  Eigen::MatrixXd B_, C_;
  double log_det_ = 0.0;
  EliminatedSegment scratch_;
};

}  // namespace trueline
