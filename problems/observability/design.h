// Designs a flight that shows chosen parameters well (Boehm et al. 2020, eq. 5): maximises the
// smallest singular value of the scaled, marginalised E2LOG Gramian within the flight's limits.
// Method: L-BFGS (Ceres) from several random starts on the logarithm of the score and a penalty on
// the limits that increases from round to round. Remaining violations are removed by shrinking the
// flight.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "problems/observability/design_score.h"
#include "problems/trajectory/limits.h"

namespace trueline {

struct DesignOptions {
  SplineShape shape;
  FlightLimits limits;
  int candidates = 80;        // random flights and figures in turn, of which the best are starts
  bool random_only = false;   // candidates are random flights alone, as published
  int starts = 2;             // optimised, each on a thread of its own
  int iterations = 60;        // of each of the penalty's rounds, at most
  double time_limit = 40.0;   // s, for all rounds of one start
  double check_step = 0.001;  // s, of the grid on which the result is checked
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all cores
};

struct DesignResult {
  PiecewisePolynomial path;
  LimitUse use;              // on the check grid
  double score = 0.0;        // sigma_min of the result, by the target's Gramian
  double start_score = 0.0;  // of the random flight or figure at the start
  int iterations = 0;
  bool time_limited = false;  // ended by the time limit: differs between machines
  double seconds = 0.0;
  std::vector<double> start_results;  // scores that the other starts reached
};

// The score of any flight: sigma_min of its scaled, marginalised E2LOG Gramian (order 4).
double FlightScore(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                   const PiecewisePolynomial& path, const DesignTarget& target);

// Throws InputError where the vehicle can't hover within the limits.
DesignResult DesignFlight(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                          const DesignTarget& target, const DesignOptions& options);

}  // namespace trueline
