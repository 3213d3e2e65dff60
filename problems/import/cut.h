// The part of a log that is kept.
#pragma once

#include "problems/import/import_map.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Leaves out what lies outside the cut, in every stream. Throws InputError naming `map_file` where
// it leaves no IMU sample, or where the height is asked for and there is no mocap.
void CutLog(const CutOptions& options, const std::string& map_file, FlightLog* log);

}  // namespace trueline
