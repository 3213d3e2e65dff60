// Which part of a flight a window covers.
#pragma once

#include "problems/vgd/window_problem.h"
#include "problems/window/flight_data.h"

namespace trueline {

// First pass (index from 0) of the window that ends with pass `tau` (from 1): gamma passes, fewer
// where the flight begins or has a gap, more where they hold too few fixes.
int FirstPassOf(const FlightData& flight, const VgdOptions& options, int tau);

// Data from pass `first` (from 0) through pass `tau` (from 1), and on to the end of the arc after
// it where there is one and `with_arc` asks for it. Points into `flight`.
WindowData CutWindow(const FlightData& flight, const VgdOptions& options, int first, int tau,
                     bool with_arc);

}  // namespace trueline
