#include "problems/rotor/rotor_prior.h"

#include <fmt/ranges.h>

namespace trueline {
namespace {

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const RotorConstantInfo& info : kRotorConstants) names.push_back(info.name);
  return names;
}

}  // namespace

std::vector<int> RotorPrior::Free() const {
  std::vector<int> free;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    if (sigma[i] > 0.0) free.push_back(i);
  }
  return free;
}

bool RotorPrior::Estimates(const std::string& name) const {
  return !name.empty() && sigma[FindRotorConstant(name)] > 0.0;
}

RotorConstants RotorPrior::WithKnown(const RotorConstants& constants) const {
  return (sigma.array() == 0.0).select(mean, constants);
}

RotorPrior PriorFromVehicle(const RotorVehicle& vehicle) {
  RotorPrior prior;
  const int moving = RotorAeroModel::kMoving;
  for (int i = moving; i < RotorDrivenModel::kStates; ++i) {
    prior.mean[i - moving] = vehicle.parameters[i];
  }
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    const RotorConstantInfo& info = kRotorConstants[i];
    prior.sigma[i] = info.relative ? info.sigma * prior.mean[i] : info.sigma;
  }
  return prior;
}

void ReadRotorPrior(const YamlMap& map, RotorPrior* prior) {
  for (const std::string& key : map.Keys()) {
    const int i = FindRotorConstant(key);
    if (i < 0) {
      map.Fail(key, fmt::format("is no constant of this model; use {}", fmt::join(Names(), ", ")));
    }
    if (map.RawNode(key).IsMap()) {
      const YamlMap entry = map.Child(key);
      prior->mean[i] = entry.Get<double>("mean", prior->mean[i]);
      prior->sigma[i] = entry.Get<double>("sigma");
      entry.Finish();
    } else {
      prior->sigma[i] = map.Get<double>(key);
    }
    if (!(prior->sigma[i] >= 0.0)) map.Fail(key, "sigma must be zero (known) or above");
  }
  map.Finish();
}

YAML::Node ToYaml(const RotorPrior& prior) {
  YAML::Node node;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    YAML::Node entry;
    entry["mean"] = prior.mean[i];
    entry["sigma"] = prior.sigma[i];
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node[kRotorConstants[i].name] = entry;
  }
  return node;
}

}  // namespace trueline
