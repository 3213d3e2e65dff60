// Conversion of a foreign log to a native one, by a column map.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/error.h"
#include "problems/import/formats/recording.h"
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

// Which channel of a recording each stream of a map is read from.

// The log is readable, but no usable native log can be made of it.
class NoUsableLog : public NoUsableResult {
 public:
  using NoUsableResult::NoUsableResult;
};

// One for each input of a map; null for CSV.
using Recordings = std::vector<std::unique_ptr<Recording>>;

// The map's streams with the channels that are there; optional ones that are not are left out, with
// a warning for all. Throws NoUsableLog if there is no IMU, InputError if another stream is
// missing.
std::map<std::string, StreamMap> ResolveChannels(const ImportMap& map, const Recordings& recordings,
                                                 std::vector<std::string>* warnings);

// How many streams of a map with one input a recording has; 0 if it lacks one that is not optional.
int CountStreams(const ImportMap& map, const Recording& recording);

}  // namespace trueline
