#include "problems/rotor_data/rotor_prior.h"

#include <fmt/ranges.h>

namespace trueline {
namespace {

void Set(RotorConstants* values, const std::string& first, const Eigen::Vector3d& value) {
  values->segment<3>(FindRotorConstant(first)) = value;
}

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const RotorConstantInfo& info : RotorConstantNames()) names.push_back(info.name);
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

RotorPrior PriorFromVehicle(const RotorVehicle& vehicle) {
  RotorPrior prior;
  const int moving = RotorAeroModel::kMoving;
  for (int i = moving; i < RotorDrivenModel::kStates; ++i) {
    prior.mean[i - moving] = vehicle.parameters[i];
  }
  const int inertia = FindRotorConstant("I_x");
  prior.sigma[0] = 0.2 * prior.mean[0];
  Set(&prior.sigma, "I_x", 0.3 * prior.mean.segment<3>(inertia));
  Set(&prior.sigma, "r_BM_x", Eigen::Vector3d::Constant(0.02));
  Set(&prior.sigma, "r_BP_x", Eigen::Vector3d::Constant(0.05));
  Set(&prior.sigma, "r_BI_x", Eigen::Vector3d(0.02, 0.02, 0.0));
  Set(&prior.sigma, "b_a_x", Eigen::Vector3d::Constant(0.5));
  Set(&prior.sigma, "b_w_x", Eigen::Vector3d::Constant(0.1));
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
    node[RotorConstantNames()[i].name] = entry;
  }
  return node;
}

}  // namespace trueline
