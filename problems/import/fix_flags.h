// Settings of the fixes sampled from mocap, given on a command line over those of the map.
#pragma once

#include <optional>
#include <string>

#include "problems/import/import_map.h"

namespace trueline {

// Negative numbers and an empty text leave what the map says.
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

// Nothing where neither the map nor a flag asks for sampled fixes. Throws InputError for a setting
// that can't be, or where the log has real fixes or no mocap.
std::optional<FixesFromMocap> OverrideFixes(const ImportMap& map, const FixFlags& flags);

}  // namespace trueline
