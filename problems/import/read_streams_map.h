// The `streams` and `time` sections of a column map.
#pragma once

#include "problems/import/import_map.h"

namespace trueline {

TimeSource ReadTimeSource(const YamlMap& map);

// Every stream that the map has, by name; `axes` are those of the whole map.
std::map<std::string, StreamMap> ReadStreamsMap(const YamlMap& map, const SourceAxes& axes,
                                                const std::vector<InputMap>& inputs);

}  // namespace trueline
