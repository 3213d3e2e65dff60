#include "problems/effects/rotor_extension.h"

#include "problems/effects/declaration.h"

namespace trueline {

void RotorExtension::Add(const std::string& constant, double value) {
  added[FindRotorConstant(constant)] += value;
}

RotorExtension RotorExtensionOf(const std::vector<Effect>& effects) {
  RotorExtension extension;
  for (const Effect& effect : effects) InfoOf(effect.id).extend(effect, &extension);
  return extension;
}

}  // namespace trueline
