// Conversion of a foreign log to a native one, by a column map.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "problems/import/import_map.h"
#include "problems/log/flight_log.h"

namespace trueline {

struct ConvertOptions {
  std::uint64_t seed = 0;           // of fixes that are sampled from mocap
  std::optional<double> fix_sigma;  // m; in place of the map's, for detected fixes
  // In place of the map's `fixes_from_mocap`.
  std::optional<FixesFromMocap> fixes_from_mocap;
};

// Reads `files` (one for each input of the map, in its order). The result holds the map's streams
// in native units and axes, cut, with fixes sampled from mocap if the map asks for that; `warnings`
// lists what was left out. Throws InputError for bad files, and if nothing remains.
FlightLog ConvertLog(const ImportMap& map, const std::vector<std::string>& files,
                     const ConvertOptions& options);

}  // namespace trueline
