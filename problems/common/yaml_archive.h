// One function describes a struct of options; reading, writing and defaults derive from it (as
// Drake's Serialize).
//
//   void Serialize(YamlArchive* a, EkfStart* start) {
//     a->Positive("position_sigma_m", &start->position);
//     a->Positive("tilt_sigma_deg", &start->tilt, kDegree);  // rad; the file's number is in deg
//   }
//   EkfStart start = FromYaml<EkfStart>(map);  // a key that is left out keeps its default
//   YAML::Node node = ToYaml(start);
//
// Reading is strict: an InputError names file, line and key of what is unknown or out of range.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <initializer_list>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "problems/common/strict_yaml.h"

namespace trueline {

class YamlArchive {
 public:
  YamlArchive() = default;                                  // writes
  explicit YamlArchive(const YamlMap& map) : map_(&map) {}  // reads; `map` must outlive this

  // What was written.
  const YAML::Node& node() const { return node_; }

  // Any value of the type; numbers are finite.
  template <class T>
  void Value(const std::string& key, T* value) {
    if (map_ != nullptr) {
      *value = map_->Get<T>(key, *value);
    } else {
      node_[key] = *value;
    }
  }
  // The file's number is in a unit of `unit`, such as kDegree. Returns the file's number.
  double Value(const std::string& key, double* value, double unit = 1.0);
  void Value(const std::string& key, Eigen::Vector3d* value);

  void Positive(const std::string& key, double* value, double unit = 1.0);
  void NotNegative(const std::string& key, double* value, double unit = 1.0);
  void NotNegative(const std::string& key, Eigen::Vector3d* value);
  void Count(const std::string& key, int* value);  // from 1

  // A value by its name; an error lists the names in this order.
  template <class Enum>
  void Choice(const std::string& key, Enum* value,
              std::initializer_list<std::pair<const char*, std::type_identity_t<Enum>>> names) {
    std::vector<std::string> known;
    std::string name;
    for (const auto& [text, named] : names) {
      known.emplace_back(text);
      if (named == *value) name = text;
    }
    if (map_ == nullptr) {
      node_[key] = name;
      return;
    }
    name = map_->GetChoice(key, known, name);
    for (const auto& [text, named] : names) {
      if (name == text) *value = named;
    }
  }

  // A mapping of its own, described by the struct's Serialize or by `describe`.
  template <class Options>
  void Nested(const std::string& key, Options* options) {
    Map(key, [options](YamlArchive* a) { Serialize(a, options); });
  }
  void Map(const std::string& key, const std::function<void(YamlArchive*)>& describe);
  // A mapping that has a reader and a writer of its own.
  void Map(const std::string& key, const std::function<void(const YamlMap&)>& read,
           const std::function<YAML::Node()>& write);

  // What was read under `key` must be `good`.
  void Require(bool good, const std::string& key, const std::string& otherwise) const {
    if (map_ != nullptr && !good) map_->Fail(key, otherwise);
  }
  // Writes this mapping on one line.
  void OnOneLine() {
    if (map_ == nullptr) node_.SetStyle(YAML::EmitterStyle::Flow);
  }

 private:
  const YamlMap* map_ = nullptr;  // null where the archive writes
  YAML::Node node_;
};

template <class Options>
void FromYaml(const YamlMap& map, Options* options) {
  YamlArchive archive(map);
  Serialize(&archive, options);
  map.Finish();
}

template <class Options>
Options FromYaml(const YamlMap& map) {
  Options options;
  FromYaml(map, &options);
  return options;
}

// All values, for the provenance of a result; FromYaml reads them back.
template <class Options>
requires requires(YamlArchive* archive, Options* options) { Serialize(archive, options); }
YAML::Node ToYaml(Options options) {
  YamlArchive archive;
  Serialize(&archive, &options);
  return archive.node();
}

}  // namespace trueline
