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

// Settings of the fixes sampled from mocap; flags override those of the map.

// Negative numbers and an empty text keep the map's values.
struct FixFlags {
  std::string straights;  // "auto", or conditions on axes of E with ';' between, all of which hold
  int min_count = -1;
  int max_count = -1;
  double sigma_factor = -1.0;
  double sigma_floor = -1.0;  // m
  double student_dof = -1.0;
  double outlier_share = -1.0;
  double outlier_size = -1.0;  // m
};

// No value if neither the map nor a flag asks for sampled fixes. Throws InputError for an
// impossible setting, or if the log has real fixes or no mocap.
std::optional<FixesFromMocap> OverrideFixes(const ImportMap& map, const FixFlags& flags);

}  // namespace trueline
