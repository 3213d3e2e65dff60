// Column maps that hold the repairs of an inspection.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <vector>

#include "problems/import/import_map.h"
#include "problems/inspection/repair.h"

namespace trueline {

// A map that converts a native log to itself, and the files of its inputs in their order.
struct NativeMap {
  YAML::Node map;
  std::vector<std::string> files;
};
NativeMap MapOfNativeLog(const FlightLog& log);

// How the map's attitudes are stated in their files, by stream.
FileAttitudes FileAttitudesOf(const ImportMap& map);

// `map` (the file's content) with the repairs. Streams that are a list are repaired in each entry.
YAML::Node CorrectMap(const YAML::Node& map, const Repairs& repairs);

}  // namespace trueline
