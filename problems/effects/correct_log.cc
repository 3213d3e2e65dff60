#include <algorithm>

#include "problems/effects/declaration.h"
#include "problems/vgd/rough_path.h"

namespace trueline {
namespace {

// Effects that are removed from a log, in order of their stages.
std::vector<const EffectInfo*> Corrections() {
  std::vector<const EffectInfo*> corrections;
  for (const EffectInfo& info : DeclaredEffects(DriveKind::kImu)) {
    if (info.correct != nullptr) corrections.push_back(&info);
  }
  for (const TermOn on : {TermOn::kAttitude, TermOn::kFix}) corrections.push_back(&TermInfo(on));
  std::stable_sort(
      corrections.begin(), corrections.end(),
      [](const EffectInfo* a, const EffectInfo* b) { return a->correct_at < b->correct_at; });
  return corrections;
}

}  // namespace

ForceEffects ForceEffectsOf(const std::vector<Effect>& effects) {
  ForceEffects force;
  for (const Effect& effect : effects) {
    const EffectInfo& info = InfoOf(effect);
    if (info.add_force != nullptr) info.add_force(effect, &force);
  }
  return force;
}

std::vector<VelocitySample> CorrectionContext::Path() const {
  if (!path.empty()) return path;
  std::vector<VelocitySample> rough;
  const std::vector<Pass> passes = FindPasses(original.fixes, PassOptions());
  if (passes.empty()) return rough;
  const RoughPath through(original.fixes, passes);
  for (TimeNs t = passes.front().begin; t <= through.end(); t += FromSeconds(0.25)) {
    const LineFit at = through.At(t);
    rough.push_back({t, at.v, at.p});
  }
  return rough;
}

FlightLog CorrectLog(const FlightLog& log, const std::vector<Effect>& effects,
                     const std::vector<VelocitySample>& path) {
  static const std::vector<const EffectInfo*> corrections = Corrections();
  FlightLog corrected = log;
  const CorrectionContext context{log, path};
  for (const EffectInfo* info : corrections) {
    for (const Effect& effect : effects) {
      if (&InfoOf(effect) == info) info->correct(effect, context, &corrected);
    }
  }
  return corrected;
}

}  // namespace trueline
