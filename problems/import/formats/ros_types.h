// Message types of ROS 1 and 2, read from their definitions.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/cell.h"

namespace trueline {

enum class RosKind { kNumber, kText, kWideText, kTime, kMessage };

struct RosField {
  std::string name;
  RosKind kind = RosKind::kNumber;
  Scalar scalar = Scalar::kU8;  // of a number
  std::string message;          // "pkg/Type" of a nested message
  bool is_list = false;
  std::optional<std::uint32_t> length;  // of a list of fixed length
};

using RosTypes = std::map<std::string, std::vector<RosField>, std::less<>>;  // by "pkg/Type"

// "pkg/msg/Type" as "pkg/Type".
std::string RosTypeName(std::string_view name);

// Adds the type `name` and those after the lines of `=`, "MSG: pkg/Type". False if a line can't be
// read.
bool ParseRosDefinition(const std::string& name, std::string_view definition, RosTypes* types);

// The usual types of ROS 2, for bags that store no definitions (sqlite3 before schema 4).
const RosTypes& CommonRosTypes();

}  // namespace trueline
