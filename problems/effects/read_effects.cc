#include "problems/effects/read_effects.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

// One left out or misspelled would silently be zero.
void CheckParameters(const YamlMap& entry, const Effect& effect) {
  const std::vector<std::string> names = InfoOf(effect.id).ParameterNames();
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

}  // namespace

std::vector<Effect> ReadEffects(const YamlMap& model, DriveKind drive) {
  std::vector<Effect> effects;
  for (const YamlMap& entry : model.Children("effects")) {
    Effect effect{entry.Get<std::string>("id"), {}};
    if (FindDeclared(effect.id, drive) == nullptr) {
      entry.Fail("id",
                 fmt::format("'{}' is no effect that an estimator can take; `trueline effects` "
                             "lists them",
                             effect.id));
    }
    for (const std::string& key : entry.Keys()) {
      if (key == "id") continue;
      effect.values[key] = entry.Get<double>(key);
      if (!std::isfinite(effect.values[key])) entry.Fail(key, "must be a finite number");
    }
    CheckParameters(entry, effect);
    effects.push_back(effect);
  }
  return effects;
}

}  // namespace trueline
