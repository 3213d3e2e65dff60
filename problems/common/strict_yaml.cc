#include "problems/common/strict_yaml.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "problems/common/error.h"

namespace trueline {

YamlMap YamlMap::FromFile(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw ErrorAt(path.string(), 0, "no such file; give the path of a YAML file");
  }
  try {
    return YamlMap(YAML::LoadFile(path.string()), path.string(), "");
  } catch (const YAML::Exception& error) {
    throw ErrorAt(path.string(), error.mark.line + 1, "not valid YAML: " + error.msg);
  }
}

YamlMap::YamlMap(const YAML::Node& node, std::string file, std::string key_path)
    : node_(node), file_(std::move(file)), key_path_(std::move(key_path)) {
  if (!node_.IsMap() && !node_.IsNull()) {
    throw ErrorAt(file_, node_.Mark().line + 1,
                  key_path_.empty() ? "expected a mapping of keys to values"
                                    : fmt::format("'{}' must be a mapping", key_path_));
  }
}

bool YamlMap::Has(const std::string& key) const {
  return node_.IsMap() && node_[key] && !node_[key].IsNull();
}

int YamlMap::LineOf(const std::string& key) const {
  const YAML::Node& node = node_;
  const YAML::Mark mark = node.IsMap() && node[key] ? node[key].Mark() : node.Mark();
  return mark.line + 1;
}

std::string YamlMap::PathOf(const std::string& key) const {
  return key_path_.empty() ? key : key_path_ + "." + key;
}

YAML::Node YamlMap::Required(const std::string& key) const {
  asked_.insert(key);
  if (!Has(key)) {
    throw ErrorAt(file_, node_.Mark().line + 1,
                  fmt::format("key '{}' is missing; add it", PathOf(key)));
  }
  return node_[key];
}

Eigen::Vector3d YamlMap::GetVector3(const std::string& key) const {
  const auto values = Get<std::vector<double>>(key);
  if (values.size() != 3) Fail(key, fmt::format("needs 3 numbers, found {}", values.size()));
  return {values[0], values[1], values[2]};
}

Eigen::Vector3d YamlMap::GetVector3(const std::string& key, const Eigen::Vector3d& fallback) const {
  asked_.insert(key);
  return Has(key) ? GetVector3(key) : fallback;
}

std::string YamlMap::GetChoice(const std::string& key, const std::vector<std::string>& allowed,
                               const std::string& fallback) const {
  std::string value = Get<std::string>(key, fallback);
  if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
    Fail(key, fmt::format("'{}' is not known; use one of: {}", value, fmt::join(allowed, ", ")));
  }
  return value;
}

YamlMap YamlMap::Child(const std::string& key) const {
  return YamlMap(Required(key), file_, PathOf(key));
}

YamlMap YamlMap::ChildOrEmpty(const std::string& key) const {
  asked_.insert(key);
  return YamlMap(Has(key) ? node_[key] : YAML::Node(), file_, PathOf(key));
}

std::vector<YamlMap> YamlMap::Children(const std::string& key) const {
  asked_.insert(key);
  std::vector<YamlMap> children;
  if (!Has(key)) return children;
  if (!node_[key].IsSequence()) Fail(key, "must be a list of mappings");
  int index = 0;
  for (const YAML::Node& item : node_[key]) {
    children.emplace_back(item, file_, fmt::format("{}[{}]", PathOf(key), index++));
  }
  return children;
}

std::vector<std::string> YamlMap::Keys() const {
  std::vector<std::string> keys;
  if (node_.IsMap()) {
    for (const auto& item : node_) {
      if (!item.first.IsScalar()) {
        throw ErrorAt(file_, item.first.Mark().line + 1, "a key must be a text");
      }
      keys.push_back(item.first.as<std::string>());
    }
  }
  return keys;
}

YAML::Node YamlMap::RawNode(const std::string& key) const {
  asked_.insert(key);
  return Has(key) ? node_[key] : YAML::Node();
}

void YamlMap::Finish() const {
  std::set<std::string> seen;
  for (const std::string& key : Keys()) {
    if (!seen.insert(key).second) Fail(key, "occurs twice; keep one");
    if (asked_.count(key) > 0) continue;
    Fail(key, fmt::format("unknown key; known here: {}", fmt::join(asked_, ", ")));
  }
}

void YamlMap::Fail(const std::string& key, const std::string& message) const {
  throw ErrorAt(file_, LineOf(key), fmt::format("'{}': {}", PathOf(key), message));
}

void YamlMap::FailConversion(const YAML::Node& value, const std::string& key) const {
  const std::string found = value.IsScalar() ? fmt::format("'{}'", value.Scalar()) : "a structure";
  Fail(key, fmt::format("{} is not a value of the expected kind", found));
}

}  // namespace trueline
