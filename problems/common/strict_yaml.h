// Strict reading of YAML mappings: a missing key, an unknown key or a value of the wrong kind is an
// InputError that names file, line, key and the remedy.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

namespace trueline {

// One mapping of a YAML file. Every key must be asked for before Finish(), which refuses the rest.
//
//   YamlMap map = YamlMap::FromFile("course.yaml");
//   const double speed = map.Get<double>("speed");          // required
//   const double noise = map.Get<double>("noise", 0.0);     // optional
//   YamlMap imu = map.Child("imu");                         // a nested mapping; Finish() it too
//   map.Finish();
class YamlMap {
 public:
  static YamlMap FromFile(const std::filesystem::path& path);
  // `file` and `key_path` are for messages only.
  YamlMap(const YAML::Node& node, std::string file, std::string key_path);

  bool Has(const std::string& key) const;
  int LineOf(const std::string& key) const;

  template <class T>
  T Get(const std::string& key) const {
    return Convert<T>(Required(key), key);
  }
  template <class T>
  T Get(const std::string& key, const T& fallback) const {
    asked_.insert(key);
    return Has(key) ? Convert<T>(node_[key], key) : fallback;
  }
  template <class T>
  std::optional<T> GetOptional(const std::string& key) const {
    asked_.insert(key);
    return Has(key) ? std::optional<T>(Convert<T>(node_[key], key)) : std::nullopt;
  }

  Eigen::Vector3d GetVector3(const std::string& key) const;
  Eigen::Vector3d GetVector3(const std::string& key, const Eigen::Vector3d& fallback) const;
  // One of `allowed`; the error lists them.
  std::string GetChoice(const std::string& key, const std::vector<std::string>& allowed,
                        const std::string& fallback) const;

  YamlMap Child(const std::string& key) const;                  // required mapping
  YamlMap ChildOrEmpty(const std::string& key) const;           // optional mapping
  std::vector<YamlMap> Children(const std::string& key) const;  // sequence of mappings; may lack
  std::vector<std::string> Keys() const;
  YAML::Node RawNode(const std::string& key) const;  // marks the key as asked for

  // Throws for the first key that was never asked for.
  void Finish() const;
  // An InputError at `key` of this mapping.
  [[noreturn]] void Fail(const std::string& key, const std::string& message) const;

  const std::string& file() const { return file_; }

 private:
  YAML::Node Required(const std::string& key) const;
  std::string PathOf(const std::string& key) const;

  // Of a number, and of each number in a list, also of lists.
  template <class T>
  static bool AllFinite(const T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      return std::isfinite(value);
    } else if constexpr (requires {
                           typename T::value_type;
                           value.begin();
                         }) {
      return std::all_of(value.begin(), value.end(), [](const auto& x) { return AllFinite(x); });
    } else {
      return true;
    }
  }

  template <class T>
  T Convert(const YAML::Node& value, const std::string& key) const {
    try {
      T converted = value.as<T>();
      if (!AllFinite(converted)) {
        Fail(key, value.IsScalar() ? "must be a finite number" : "must be finite numbers");
      }
      return converted;
    } catch (const YAML::Exception&) {
      FailConversion(value, key);
    }
  }
  [[noreturn]] void FailConversion(const YAML::Node& value, const std::string& key) const;

  YAML::Node node_;
  std::string file_;
  std::string key_path_;
  mutable std::set<std::string> asked_;
};

}  // namespace trueline
