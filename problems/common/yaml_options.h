// Helpers that read options over their defaults and write them back.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"

namespace trueline {

// The key of an enumerator in a table of names.
template <class Enum>
std::string NameOf(const std::map<std::string, Enum>& names, Enum value) {
  for (const auto& [name, candidate] : names) {
    if (candidate == value) return name;
  }
  return "";
}

// Reads `key` into *value; a name that is not in `names` is an InputError that lists them.
template <class Enum>
void ReadOption(const YamlMap& map, const std::string& key,
                const std::map<std::string, Enum>& names, Enum* value) {
  std::vector<std::string> allowed;
  allowed.reserve(names.size());
  for (const auto& [name, candidate] : names) allowed.push_back(name);
  *value = names.at(map.GetChoice(key, allowed, NameOf(names, *value)));
}

template <class T>
void ReadOption(const YamlMap& map, const std::string& key, T* value) {
  *value = map.Get<T>(key, *value);
}

inline void ReadFinite(const YamlMap& map, const std::string& key, double* value) {
  ReadOption(map, key, value);
  if (!std::isfinite(*value)) map.Fail(key, "must be a finite number");
}

inline void ReadFinite(const YamlMap& map, const std::string& key, Eigen::Vector3d* value) {
  *value = map.GetVector3(key, *value);
  if (!value->allFinite()) map.Fail(key, "must be finite numbers");
}

// The file's number is in a unit of `unit` (such as kDegree); it must be finite and above zero.
inline void ReadPositive(const YamlMap& map, const std::string& key, double* value,
                         double unit = 1.0) {
  const double read = map.Get<double>(key, *value / unit);
  if (!(read > 0.0) || std::isinf(read)) {
    map.Fail(key, fmt::format("must be above zero and finite, found {}", read));
  }
  *value = unit * read;
}

inline void ReadNotNegative(const YamlMap& map, const std::string& key, double* value,
                            double unit = 1.0) {
  const double read = map.Get<double>(key, *value / unit);
  if (!(read >= 0.0) || std::isinf(read)) {
    map.Fail(key, fmt::format("must be zero or above and finite, found {}", read));
  }
  *value = unit * read;
}

inline void ReadNotNegative(const YamlMap& map, const std::string& key, Eigen::Vector3d* value) {
  ReadFinite(map, key, value);
  if (value->minCoeff() < 0.0) map.Fail(key, "must be zero or above on each axis");
}

// A whole number from 1.
inline void ReadCount(const YamlMap& map, const std::string& key, int* value) {
  ReadOption(map, key, value);
  if (*value < 1) map.Fail(key, "must be 1 or more");
}

}  // namespace trueline
