// The `fixes_from_mocap` section of a column map.
#pragma once

#include "problems/import/import_map.h"

namespace trueline {

FixesFromMocap ReadFixesFromMocap(const YamlMap& map);

// The keys of FixSamplerOptions, where `map` has them; the others keep their defaults.
FixSamplerOptions ReadFixSamplerOptions(const YamlMap& map);

// A condition "low<x<high" on one axis of E as a box; `where` names its origin, for the error.
StraightBox ParseBoxCondition(const std::string& condition, const std::string& where);

}  // namespace trueline
