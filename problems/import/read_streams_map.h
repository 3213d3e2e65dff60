// The `streams` and `time` sections of a column map.
#pragma once

#include "problems/import/import_map.h"

namespace trueline {

// Without a column, which only a recording may lack, it is the rows' own time plus the offset.
TimeSource ReadTimeSource(const YamlMap& map, bool is_csv);

// The key `unsorted`, of an input or a stream.
Unsorted ReadUnsorted(const YamlMap& map, Unsorted fallback);

// Every stream that the map has, by name; `axes` are those of the whole map.
std::map<std::string, StreamMap> ReadStreamsMap(const YamlMap& map, const SourceAxes& axes,
                                                const std::vector<InputMap>& inputs);

}  // namespace trueline
