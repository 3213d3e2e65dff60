// What a flight gives to the problem of one window.
#pragma once

#include "problems/vgd/window_problem.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Passes first (index) to tau (from 1), and the arc after them where there is one. `flight` must
// outlive the result.
WindowData WindowDataOf(const FlightData& flight, const VgdOptions& options, int first, int tau);

}  // namespace trueline
