// What a fit of whole flights is given.
#pragma once

#include <limits>
#include <set>

#include "problems/vgd/flight_data.h"

namespace trueline {

// Optional unknowns, by the sigma of their prior; zero: not estimated.
struct DetectorUnknowns {
  double fix_latency = 0.0;          // s
  double camera_misalignment = 0.0;  // rad, each axis
  double gate_offset = 0.0;          // m, each axis of each gate

  bool Any() const { return fix_latency > 0.0 || camera_misalignment > 0.0 || gate_offset > 0.0; }
};

// A flight with its learned process and held parameters; it must outlive the problem.
struct FlightShare {
  const FlightData* flight;
  std::set<int> false_passes;                    // indices of passes whose fixes do not count
  int passes = std::numeric_limits<int>::max();  // use the first so many passes
};

}  // namespace trueline
