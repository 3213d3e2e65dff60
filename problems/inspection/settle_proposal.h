// Logs that come without a map: what names leave open in a proposal, the streams settle together.
#pragma once

#include <optional>
#include <string>

#include "problems/import/find_map.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Where the names of the log's columns only suggest units, the form of a quaternion or axes, and
// an inspection of the log so read shows others, `found` gets the map that reads those, and a line
// in `assumed` for each. The corrected map counts only if an inspection of what it reads has fewer
// faults. A map that ships is taken for its units' names in tables alone: recordings state them. Of
// a recording only the axes are settled, where another one points up than its map says.
// Returns the log that the map in `found` then reads; none where that was not tried.
std::optional<FlightLog> SettleProposal(FoundLog* found);

// A native log's folder, or any other log, which is converted on the way: by the file `map`, or
// where that is empty by FindLog() and SettleProposal(). The log may lack the IMU where it has
// motor commands.
FlightLog ReadAnyLog(const std::string& path, const std::string& map = "");

// Mocap on the clock of the IMU, by accelerations.

// Adds to the stamps of mocap what makes the second differences of its positions agree best with
// the accelerometer, turned to earth by the logged attitude. Fixes that were sampled from mocap
// move with it if `sampled_fixes`. Returns what was done, as a sentence; empty where the clocks
// agree within 4 ms or 4 sigma, or where the flight does not show it. A clock that drifts by
// kPlaceClock.drift or more is said, too.
std::string AlignMocap(bool sampled_fixes, FlightLog* log);

}  // namespace trueline
