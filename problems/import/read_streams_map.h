// The `streams` and `time` sections of a column map.
#pragma once

#include "problems/import/import_map.h"

namespace trueline {

TimeSource ReadTimeSource(const YamlMap& map);

// Reads every stream into `import`, whose inputs are known; `axes` are those of the whole map.
void ReadStreamsMap(const YamlMap& map, const SourceAxes& axes, ImportMap* import);

}  // namespace trueline
