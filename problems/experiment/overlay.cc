#include "problems/experiment/overlay.h"

#include <fmt/format.h>

#include <cstdlib>

#include "problems/common/error.h"

namespace trueline {
namespace {

bool IsMapping(const YAML::Node& node) { return node.IsDefined() && node.IsMap(); }

}  // namespace

YAML::Node Merge(const YAML::Node& base, const YAML::Node& over) {
  if (!over.IsDefined() || over.IsNull()) return base;
  if (!IsMapping(base) || !over.IsMap()) return over;
  YAML::Node merged(YAML::NodeType::Map);
  for (const auto& item : base) merged[item.first.as<std::string>()] = item.second;
  for (const auto& item : over) {
    const auto key = item.first.as<std::string>();
    merged[key] = Merge(base[key], item.second);
  }
  return merged;
}

YAML::Node WithSetting(const YAML::Node& base, const std::string& path, const YAML::Node& value) {
  const std::size_t dot = path.find('.');
  const std::string key = path.substr(0, dot);
  YAML::Node copy(YAML::NodeType::Map);
  if (IsMapping(base)) {
    for (const auto& item : base) copy[item.first.as<std::string>()] = item.second;
  }
  if (dot == std::string::npos) {
    copy[key] = value;
  } else {
    const bool has = IsMapping(base) && base[key].IsDefined();
    copy[key] = WithSetting(has ? base[key] : YAML::Node(), path.substr(dot + 1), value);
  }
  return copy;
}

YAML::Node WithSettings(const YAML::Node& base, const std::vector<Setting>& settings) {
  YAML::Node node;
  node.reset(base);  // `=` would change the node that `base` refers to
  for (const Setting& setting : settings) {
    node.reset(WithSetting(node, setting.path, setting.value));
  }
  return node;
}

std::vector<Setting> ReadSettings(const YamlMap& map) {
  std::vector<Setting> settings;
  for (const std::string& key : map.Keys()) {
    settings.push_back({key, map.RawNode(key), map.LineOf(key)});
  }
  return settings;
}

namespace {

// Replaces ${NAME} by the environment variable NAME.
std::string ExpandVariables(const std::string& text, const YamlMap& map, const std::string& key) {
  std::string result = text;
  for (std::size_t at = result.find("${"); at != std::string::npos; at = result.find("${")) {
    const std::size_t end = result.find('}', at);
    if (end == std::string::npos) map.Fail(key, "has '${' without '}'");
    const std::string name = result.substr(at + 2, end - at - 2);
    const char* value = std::getenv(name.c_str());
    if (value == nullptr || std::string(value).find("${") != std::string::npos) {
      map.Fail(key,
               fmt::format("the environment variable {} is not set; export {}=FOLDER", name, name));
    }
    result.replace(at, end - at + 1, value);
  }
  return result;
}

std::string CheckedName(const std::string& name, const YamlMap& map, const std::string& key) {
  if (name.empty() || name.find_first_of(",\"\n\r") != std::string::npos) {
    map.Fail(key, "needs a name without commas, quotes and line breaks");
  }
  return name;
}

}  // namespace

std::filesystem::path ReadPath(const YamlMap& map, const std::string& key,
                               const std::string& text) {
  const std::filesystem::path path = ExpandVariables(text, map, key);
  std::filesystem::path full =
      path.is_absolute()
          ? path
          : (std::filesystem::path(map.file()).parent_path() / path).lexically_normal();
  if (!std::filesystem::exists(full)) {
    map.Fail(key, fmt::format("'{}' does not exist", full.string()));
  }
  return full;
}

std::filesystem::path ReadPath(const YamlMap& map, const std::string& key) {
  return ReadPath(map, key, map.Get<std::string>(key));
}

std::string ReadName(const YamlMap& map, const std::string& key, const std::string& fallback) {
  return CheckedName(map.Get<std::string>(key, fallback), map, key);
}

std::string ReadName(const YamlMap& map, const std::string& key) {
  return CheckedName(map.Get<std::string>(key), map, key);
}

std::filesystem::path ReadFilePath(const YamlMap& map, const std::string& key) {
  std::filesystem::path path = ReadPath(map, key);
  if (std::filesystem::is_directory(path)) {
    map.Fail(key, fmt::format("'{}' is a folder; give the path of a YAML file", path.string()));
  }
  return path;
}

std::filesystem::path ReadFolderPath(const YamlMap& map, const std::string& key) {
  std::filesystem::path path = ReadPath(map, key);
  if (!std::filesystem::is_directory(path)) {
    map.Fail(key, fmt::format("'{}' is not a folder; give the folder of a native log, or convert "
                              "the file by trueline convert",
                              path.string()));
  }
  return path;
}

}  // namespace trueline
