#include "problems/effects/rotor_extension.h"

#include "problems/effects/declaration.h"
#include "problems/vgd/term_series.h"

namespace trueline {

void RotorExtension::Add(const std::string& constant, double value) {
  added[FindRotorConstant(constant)] += value;
}

RotorExtension RotorExtensionOf(const std::vector<Effect>& effects) {
  RotorExtension extension;
  for (const Effect& effect : effects) InfoOf(effect).extend(effect, &extension);
  return extension;
}

RotorEffects RotorEffectsOn(const FlightLog& log, const std::vector<Effect>& effects) {
  RotorEffects on_log = RotorExtensionOf(effects).effects;
  BindTerms(log, &on_log.terms);
  return on_log;
}

}  // namespace trueline
