// Merging of YAML: an experiment changes keys of the files that it names. Paths and names in YAML.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "problems/common/strict_yaml.h"

namespace trueline {

// A key path such as detector.sigma_factor, its value, and its line in the experiment.
struct Setting {
  std::string path;
  YAML::Node value;
  int line = 0;
};

// `over` merged into `base`: mappings are joined key by key, everything else is replaced. Neither
// argument changes.
YAML::Node Merge(const YAML::Node& base, const YAML::Node& over);

// A copy of `base` with the value at `path` replaced; missing mappings on the path are created.
YAML::Node WithSetting(const YAML::Node& base, const std::string& path, const YAML::Node& value);

// All of `settings` in their order.
YAML::Node WithSettings(const YAML::Node& base, const std::vector<Setting>& settings);

// The entries of a mapping from key paths to values, in its order.
std::vector<Setting> ReadSettings(const YamlMap& map);

// The path `text`, or the value of `key`. ${NAME} stands for the environment variable NAME, and
// relative paths start at the file's own folder. Throws InputError at `key` of `map` where the
// variable is not set or the path does not exist.
std::filesystem::path ReadPath(const YamlMap& map, const std::string& key, const std::string& text);
std::filesystem::path ReadPath(const YamlMap& map, const std::string& key);
// The same; the path must be that of a file, or of a folder.
std::filesystem::path ReadFilePath(const YamlMap& map, const std::string& key);
std::filesystem::path ReadFolderPath(const YamlMap& map, const std::string& key);

// The value of `key`, or `fallback` without it: a name that becomes a field of CSV files. Throws
// InputError at `key` of `map` where it is empty or would break a row, or is missing without a
// fallback.
std::string ReadName(const YamlMap& map, const std::string& key, const std::string& fallback);
std::string ReadName(const YamlMap& map, const std::string& key);

}  // namespace trueline
