// Whitened rows of one segment of a flight's chain (bordered_chain.h).
#pragma once

#include "cost_functions/continuity_residual.h"
#include "problems/chain/bordered_chain.h"
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
  Columns Only(const std::vector<int>& kept) const;
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
  LinearFlight WithColumns(const Columns& other) const { return {flight, rows, x, weight, other}; }
};

// Rows over a segment's own unknowns, the next segment's and the border (theta, columns, residual).
// The id of a measurement is its row in FlightRows.
using SegmentRows = NodeRows<kNodeSize>;

// Fixes (or forces) of a segment, their sigmas times `scale`.
SegmentRows FixStack(const LinearFlight& linear, int segment, double scale);
SegmentRows ForceStack(const LinearFlight& linear, int segment, double sigma);
// The process rows from a segment to the next, if one follows: (p, v, drift) with the covariance
// that the processes accumulate, and the gust.
SegmentRows LinkStack(const LinearFlight& linear, int segment, const NoiseStrengths& noise);
// Its parts: the weights of the step; the rows before whitening as far as no noise changes them,
// none where no segment follows; what the processes' memory changes in them.
ContinuityResidual::Weights LinkWeights(const BaseFlight& flight, int segment,
                                        const NoiseStrengths& noise);
SegmentRows PathRows(const LinearFlight& linear, int segment);
void EnterProcesses(const LinearFlight& linear, int segment,
                    const ContinuityResidual::Weights& weights, SegmentRows* link);
// The prior on a stretch's first unknowns.
SegmentRows StartStack(const LinearFlight& linear, int segment, const NoiseStrengths& noise);
// Half the squares of all process rows and start priors.
double ProcessCost(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
                   const NoiseStrengths& noise);
bool StartsStretch(const FlightPlan& plan, int segment);

}  // namespace trueline
