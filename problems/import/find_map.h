// The map for a log when none is given.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/import/formats/recording.h"
#include "problems/import/import_map.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Of the maps that ship, the one for this log's format of which it has the most streams; none if it
// has the IMU of none. A CSV file fits a map that finds every column by its name.
std::optional<ImportMap> FindShippedMap(const Recording& recording);

// A map to edit, as YAML: channels and columns by the names of their fields; axes and units that no
// name states by the size of the numbers, as comments say.
std::string ProposeMap(Recording* recording);

// Why FindShippedMap() found none, as the end of a sentence about the file.
std::string WhyNoMapFits(Recording* recording);

// What a log made by a map that nobody has checked lacks for a calibration, and what to do about
// it. Throws NoUsableLog for what no calibration can do without; `file` is the foreign log.
std::vector<std::string> Shortcomings(const FlightLog& log, const std::string& file);

}  // namespace trueline
