// The `fixes_from_mocap` section of a column map.
#pragma once

#include <optional>
#include <string>

#include "problems/import/import_map.h"

namespace trueline {

FixesFromMocap ReadFixesFromMocap(const YamlMap& map);

// The keys of FixSamplerOptions, where `map` has them; the others keep their defaults.
FixSamplerOptions ReadFixSamplerOptions(const YamlMap& map);

// A condition "low<x<high" on one axis of E as a box; `where` names its origin, for the error.
StraightBox ParseBoxCondition(const std::string& condition, const std::string& where);

// Settings of the fixes sampled from mocap; flags override those of the map: `numbers` by the keys
// of FixSamplerOptions, of which a negative one keeps the map's, and `straights`: "auto", or
// conditions on axes of E with ';' between, all of which hold. No value if neither the map nor a
// flag asks for sampled fixes. Throws InputError for an impossible setting, or if the log has real
// fixes or no mocap.
std::optional<FixesFromMocap> OverrideFixes(const ImportMap& map,
                                            const std::map<std::string, double>& numbers,
                                            const std::string& straights);

}  // namespace trueline
