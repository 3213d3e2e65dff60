// Small helpers with which options are read over their defaults, and written back.
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

// Reads `key` over *value; what is not in `names` is an InputError that lists them.
template <class Enum>
void ReadOption(const YamlMap& map, const std::string& key,
                const std::map<std::string, Enum>& names, Enum* value) {
  std::vector<std::string> allowed;
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

}  // namespace trueline
