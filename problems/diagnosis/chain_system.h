// The linearised flight as a chain of segments with a border: theta, effect parameters, the
// residual.
#pragma once

#include <vector>

#include "problems/chain/bordered_chain.h"
#include "problems/chain/section_chain.h"
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

// Whitened rows over a segment's own unknowns, the next segment's and the border (theta, columns,
// residual). The id of a measurement is its row in FlightRows.
using SegmentRows = NodeRows<kNodeSize>;
// All of a segment: fixes, forces, the processes to the next segment if one follows, and the prior
// on a stretch's first unknowns.
SegmentRows RowsOf(const LinearFlight& linear, int segment, const NoiseStrengths& noise);
// Half the squares of all process rows and start priors.
double ProcessCost(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
                   const NoiseStrengths& noise);

// Priors of theta (in its own sigmas) and of the columns.
ReducedSystem::Prior BorderPrior(const LinearFlight& linear);

class ChainSystem {
 public:
  // All that `linear` refers to must outlive this object.
  ChainSystem(const LinearFlight& linear, const NoiseStrengths& noise);

  const BorderedChain<kNodeSize>& chain() const { return chain_; }
  int border() const { return chain_.border(); }
  // As one cluster; and by the clusters of the flight's plan.
  const ReducedSystem& reduced() const { return reduced_; }
  ReducedSystem ByCluster() const;

  // Whitened residuals of the measurement rows for border values `e` (ReducedSystem::Fitted).
  Eigen::VectorXd Whitened(const Eigen::VectorXd& e) const;

 private:
  const BaseFlight& flight_;
  ReducedSystem::Prior prior_;
  BorderedChain<kNodeSize> chain_;
  ReducedSystem reduced_;
};

// One linearised flight under many strengths of noise: gives what ChainSystem::reduced does, as one
// cluster. What no strength changes is made once, and no factor is kept, so that a search over
// strengths is fast. For one thread.
class NoisyFlight {
 public:
  // What `linear` refers to must outlive this object.
  explicit NoisyFlight(const LinearFlight& linear);

  ReducedSystem Reduced(const NoiseStrengths& noise);

 private:
  using Chain = SectionChain<kNodeSize, 0>;
  using Rows = SegmentRows::Values;

  // Whitened with strengths of one, columns in the chain's order.
  struct Measurements {
    Rows rows;
    int count;           // of measurements; `rows` may hold fewer of the same squares
    double log_weights;  // of all
  };
  struct Segment {
    Measurements fixes, forces;
    SegmentRows link;  // not whitened
  };

  double AddLink(int segment, const NoiseStrengths& noise);

  LinearFlight linear_;
  std::vector<Segment> segments_;
  Chain chain_;
  Rows whitened_, ordered_;  // of a link
};

}  // namespace trueline
