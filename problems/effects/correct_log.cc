#include <algorithm>

#include "problems/effects/declaration.h"

namespace trueline {
namespace {

// Effects that are removed from a log, in order of their stages.
std::vector<const EffectInfo*> Corrections() {
  std::vector<const EffectInfo*> corrections;
  for (const EffectInfo& info : DeclaredEffects(DriveKind::kImu)) {
    if (info.correct != nullptr) corrections.push_back(&info);
  }
  std::stable_sort(
      corrections.begin(), corrections.end(),
      [](const EffectInfo* a, const EffectInfo* b) { return a->correct_at < b->correct_at; });
  return corrections;
}

}  // namespace

ForceEffects ForceEffectsOf(const std::vector<Effect>& effects) {
  ForceEffects force;
  for (const Effect& effect : effects) {
    const EffectInfo& info = InfoOf(effect.id);
    if (info.add_force != nullptr) info.add_force(effect, &force);
  }
  return force;
}

FlightLog CorrectLog(const FlightLog& log, const std::vector<Effect>& effects,
                     const std::vector<VelocitySample>& path) {
  static const std::vector<const EffectInfo*> corrections = Corrections();
  FlightLog corrected = log;
  const CorrectionContext context{log, path};
  for (const EffectInfo* info : corrections) {
    for (const Effect& effect : effects) {
      if (effect.id == info->id) info->correct(effect, context, &corrected);
    }
  }
  return corrected;
}

}  // namespace trueline
