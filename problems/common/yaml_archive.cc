#include "problems/common/yaml_archive.h"

#include <fmt/format.h>

namespace trueline {

double YamlArchive::Value(const std::string& key, double* value, double unit) {
  double number = *value / unit;
  Value<double>(key, &number);
  if (map_ != nullptr) *value = unit * number;
  return number;
}

void YamlArchive::Value(const std::string& key, Eigen::Vector3d* value) {
  if (map_ != nullptr) {
    *value = map_->GetVector3(key, *value);
  } else {
    node_[key] = std::vector<double>(value->begin(), value->end());
  }
}

void YamlArchive::Positive(const std::string& key, double* value, double unit) {
  const double number = Value(key, value, unit);
  Require(number > 0.0, key, fmt::format("must be above zero and finite, found {}", number));
}

void YamlArchive::NotNegative(const std::string& key, double* value, double unit) {
  const double number = Value(key, value, unit);
  Require(number >= 0.0, key, fmt::format("must be zero or above and finite, found {}", number));
}

void YamlArchive::NotNegative(const std::string& key, Eigen::Vector3d* value) {
  Value(key, value);
  Require(value->minCoeff() >= 0.0, key, "must be zero or above on each axis");
}

void YamlArchive::Count(const std::string& key, int* value) {
  Value(key, value);
  Require(*value >= 1, key, "must be 1 or more");
}

void YamlArchive::Map(const std::string& key, const std::function<void(YamlArchive*)>& describe) {
  if (map_ == nullptr) {
    YamlArchive child;
    describe(&child);
    node_[key] = child.node_;
    return;
  }
  const YamlMap map = map_->ChildOrEmpty(key);
  YamlArchive child(map);
  describe(&child);
  map.Finish();
}

void YamlArchive::Map(const std::string& key, const std::function<void(const YamlMap&)>& read,
                      const std::function<YAML::Node()>& write) {
  if (map_ != nullptr) {
    read(map_->ChildOrEmpty(key));
  } else {
    node_[key] = write();
  }
}

}  // namespace trueline
