// Helpers that read options over their defaults and write them back.
#pragma once

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

// The file's number is in a unit of `unit` (such as kDegree); it must be above zero.
inline void ReadPositive(const YamlMap& map, const std::string& key, double* value,
                         double unit = 1.0) {
  *value = unit * map.Get<double>(key, *value / unit);
  if (!(*value > 0.0)) map.Fail(key, "must be above zero");
}

inline void ReadNotNegative(const YamlMap& map, const std::string& key, double* value,
                            double unit = 1.0) {
  *value = unit * map.Get<double>(key, *value / unit);
  if (!(*value >= 0.0)) map.Fail(key, "must be zero or above");
}

// A whole number from 1.
inline void ReadCount(const YamlMap& map, const std::string& key, int* value) {
  ReadOption(map, key, value);
  if (*value < 1) map.Fail(key, "must be 1 or more");
}

}  // namespace trueline
