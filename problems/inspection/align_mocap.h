// Mocap on the clock of the IMU, by accelerations.
#pragma once

#include <string>

#include "problems/log/flight_log.h"

namespace trueline {

// Adds to the stamps of mocap what makes the second differences of its positions agree best with
// the accelerometer, turned to earth by the logged attitude. Fixes that were sampled from mocap
// move with it if `sampled_fixes`. Returns what was done, as a sentence; empty where the clocks
// agree within 4 ms or 4 sigma, or where the flight does not show it. A clock that drifts by
// kOrdinaryDrift or more is said, too.
std::string AlignMocap(bool sampled_fixes, FlightLog* log);

}  // namespace trueline
