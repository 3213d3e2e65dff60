// The part of a log that is kept.
#pragma once

#include "problems/import/import_map.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Removes all samples outside of the cut from every stream. Throws InputError naming `map_file` if
// no IMU sample remains, or if a height is given and there is no mocap.
void CutLog(const CutOptions& options, const std::string& map_file, FlightLog* log);

}  // namespace trueline
