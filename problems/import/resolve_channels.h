// Which channel of a recording each stream of a map is read from.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/common/error.h"
#include "problems/import/formats/recording.h"
#include "problems/import/import_map.h"

namespace trueline {

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
