#include "problems/effects/read_effects.h"

#include <fmt/format.h>

#include <cmath>

namespace trueline {

std::vector<Effect> ReadEffects(const YamlMap& model, bool (*known)(const std::string& id)) {
  std::vector<Effect> effects;
  for (const YamlMap& entry : model.Children("effects")) {
    Effect effect{entry.Get<std::string>("id"), {}};
    if (!known(effect.id)) {
      entry.Fail("id", fmt::format("'{}' is no effect that an estimator can take; see the ids that "
                                   "trueline-diagnose lists",
                                   effect.id));
    }
    for (const std::string& key : entry.Keys()) {
      if (key == "id") continue;
      effect.values[key] = entry.Get<double>(key);
      if (!std::isfinite(effect.values[key])) entry.Fail(key, "must be a finite number");
    }
    effects.push_back(effect);
  }
  return effects;
}

}  // namespace trueline
