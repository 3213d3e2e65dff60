// Which part of a flight a window covers.
#pragma once

#include "problems/vgd/window_problem.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Data from pass `first` (from 0) through pass `tau` (from 1), and on to the end of the arc after
// it where there is one and `with_arc` asks for it. Points into `flight`.
WindowData CutWindow(const FlightData& flight, const VgdOptions& options, int first, int tau,
                     bool with_arc);

}  // namespace trueline
