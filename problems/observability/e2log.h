// E2LOG, the expanded empirical local observability Gramian (Boehm et al. 2020, eq. 2-4): Taylor
// series of the output's gradient on short segments. A segment's Gramian is one for the state at
// its start; the transition matrices chain them to the state at the start of the flight. The paper
// does not chain: it adds the segments' Gramians.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "problems/observability/rotor_driven_system.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {

struct E2logOptions {
  int order = 3;         // of the Taylor series, 1 to 6
  double segment = 0.1;  // s; a segment never spans a break of the trajectory
  bool chained = true;   // false: the sum of the segments' Gramians, as published
  int threads = 1;       // 0: all cores
};

// Starts and durations of the segments: each piece of the path in equal parts of at most `longest`.
struct SegmentTimes {
  int piece = 0;
  double start = 0.0;
  double duration = 0.0;
};
std::vector<SegmentTimes> SplitIntoSegments(const PiecewisePolynomial& path, double longest);

// kErrors x kErrors, with respect to the error state at the start of the flight. `weights` scale
// the outputs: ones for the papers' Gramian, RotorDrivenSystem::OutputWeights() for Fisher
// information. Throws InputError for an order or a segment out of range. Flight: RotorFlight, or a
// recorded NominalFlight, whose inputs are polynomials of the order's degree fitted over a segment.
template <class Flight>
Eigen::MatrixXd E2log(const RotorDrivenSystem& system, const Flight& flight,
                      const std::vector<double>& weights, const E2logOptions& options);

}  // namespace trueline
