#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/effects/declaration.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

// One left out or misspelled would silently be zero.
void CheckParameters(const YamlMap& entry, const Effect& effect) {
  const std::vector<std::string> names = InfoOf(effect).ParameterNames();
  const std::string all = fmt::format("{} takes {}", effect.id, fmt::join(names, ", "));
  for (const auto& [key, value] : effect.values) {
    if (std::find(names.begin(), names.end(), key) == names.end()) {
      entry.Fail(key, "is no parameter of this effect; " + all);
    }
  }
  for (const std::string& name : names) {
    if (effect.values.count(name) == 0) entry.Fail("id", fmt::format("'{}' lacks; {}", name, all));
  }
}

void CheckDrive(const YamlMap& entry, const Effect& effect, DriveKind drive) {
  const EffectInfo& info = InfoOf(effect);
  const bool imu = drive == DriveKind::kImu;
  if (imu ? info.add_force == nullptr && info.correct == nullptr : info.extend == nullptr) {
    entry.Fail("where", fmt::format("{} does not enter the model that {}", effect.term->Where(),
                                    imu ? "the IMU drives; forces, attitude and fixes do"
                                        : "rotor speeds drive; forces and moments do"));
  }
}

}  // namespace

// {id: term, where: force_x, with: q*v_x, size: 0.3, unit: ...}; sigma and text are for people.
Effect ReadTerm(const YamlMap& entry) {
  entry.Get<std::string>("id");
  Effect effect{"term", {}};
  try {
    effect.term = std::make_shared<TermForm>(
        ParseTerm(entry.Get<std::string>("where"), entry.Get<std::string>("with")));
  } catch (const TermError& error) {
    entry.Fail(error.key, error.text);
  }
  effect.values["size"] = entry.Get<double>("size");
  const auto unit = entry.Get<std::string>("unit");
  if (unit != effect.term->Unit()) {
    entry.Fail("unit", fmt::format("is '{}'; of {} with {} it is '{}'", unit, effect.term->Where(),
                                   SymbolsOf(effect.term->with), effect.term->Unit()));
  }
  const auto sigma = entry.GetOptional<double>("sigma");
  if (sigma) effect.values["sigma"] = *sigma;
  entry.Get<std::string>("text", std::string());
  entry.Finish();
  return effect;
}

std::vector<Effect> ReadEffects(const YamlMap& model, DriveKind drive) {
  std::vector<Effect> effects;
  for (const YamlMap& entry : model.Children("effects")) {
    Effect effect{entry.Get<std::string>("id"), {}};
    if (effect.id == "term") {
      effects.push_back(ReadTerm(entry));
      CheckDrive(entry, effects.back(), drive);
      continue;
    }
    if (FindDeclared(effect.id, drive) == nullptr) {
      entry.Fail("id",
                 fmt::format("'{}' is no effect that an estimator can take; `trueline effects` "
                             "lists them",
                             effect.id));
    }
    for (const std::string& key : entry.Keys()) {
      if (key == "id") continue;
      effect.values[key] = entry.Get<double>(key);
    }
    CheckParameters(entry, effect);
    effects.push_back(effect);
  }
  return effects;
}

YAML::Node ToYaml(const Effect& effect) {
  YAML::Node node;
  node["id"] = effect.id;
  if (effect.term) {
    node["where"] = effect.term->Where();
    node["with"] = SymbolsOf(effect.term->with);
    node["unit"] = effect.term->Unit();
    node["text"] = effect.term->Text(effect["size"], effect["sigma"]);
  }
  for (const auto& [name, value] : effect.values) node[name] = RoundedOrWhole(value, 6);
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node EffectsNode(const std::vector<Effect>& effects) {
  YAML::Node node(YAML::NodeType::Sequence);
  for (const Effect& effect : effects) node.push_back(ToYaml(effect));
  if (effects.empty()) node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

}  // namespace trueline
