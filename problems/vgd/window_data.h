// The part of a flight that a window covers.
#pragma once

#include <span>
#include <vector>

#include "problems/vgd/continuous_fixes.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// A pass whose fixes share an unknown error: an offset and its constant rate.
struct PassOffset {
  int pass;           // index among the window's passes
  double sigma;       // m, prior of the offset for each axis
  double rate_sigma;  // m/s, prior of its rate
};

struct WindowData {
  TimeNs begin;                // of the first fix
  TimeNs end;                  // of the predicted arc (or of the last fix where none follows)
  std::span<const Fix> fixes;  // within [begin, end]
  std::span<const Pass> passes;
  std::span<const ForceSample> forces;
  double force_sigma;               // m/s^2
  std::vector<PassOffset> offsets;  // of the passes that have one, ascending
  FixNoise noise = {};              // of fixes without gates
};

// The start of a solve: the parameters of eq. 16 in their own units.
using Theta = Eigen::Matrix<double, kMotionSize, 1>;

// Data from pass `first` (from 0) through pass `tau` (from 1), and to the end of the arc after it
// if `with_arc` and there is one. Points into `flight`.
WindowData CutWindow(const FlightData& flight, const VgdOptions& options, int first, int tau,
                     bool with_arc);
// The same up to `end`, which lies on the arc after pass `tau` or at its ends.
WindowData CutWindowUntil(const FlightData& flight, const VgdOptions& options, int first, int tau,
                          TimeNs end);

}  // namespace trueline
