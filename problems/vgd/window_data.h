// The part of a flight that a window covers.
#pragma once

#include "problems/vgd/flight_data.h"
#include "problems/vgd/window_problem.h"

namespace trueline {

// Data from pass `first` (from 0) through pass `tau` (from 1), and to the end of the arc after it
// if `with_arc` and there is one. Points into `flight`.
WindowData CutWindow(const FlightData& flight, const VgdOptions& options, int first, int tau,
                     bool with_arc);
// The same up to `end`, which lies on the arc after pass `tau` or at its ends.
WindowData CutWindowUntil(const FlightData& flight, const VgdOptions& options, int first, int tau,
                          TimeNs end);

}  // namespace trueline
