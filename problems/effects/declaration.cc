#include "problems/effects/declaration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glog/logging.h>

#include <algorithm>

#include "problems/vgd/rough_path.h"

namespace trueline {

bool EffectInfo::HasIndex(const std::string& name) const {
  return std::any_of(indices.begin(), indices.end(),
                     [&](const EffectIndexInfo& index) { return index.name == name; });
}

std::vector<std::string> EffectInfo::ParameterNames() const {
  std::vector<std::string> names;
  for (const EffectIndexInfo& index : indices) names.push_back(index.name);
  for (const EffectParameterInfo& parameter : parameters) names.push_back(parameter.name);
  return names;
}

namespace {

std::vector<EffectInfo> ImuDrivenDeclarations() {
  std::vector<EffectInfo> all = ForceDeclarations();
  for (const auto& part :
       {AccelerometerDeclarations(), AttitudeDeclarations(), FixDeclarations()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

}  // namespace

const std::vector<EffectInfo>& DeclaredEffects(DriveKind drive) {
  static const std::vector<EffectInfo> imu = ImuDrivenDeclarations();
  static const std::vector<EffectInfo> rotors = RotorDrivenDeclarations();
  return drive == DriveKind::kImu ? imu : rotors;
}

std::vector<const EffectInfo*> CausesOf(DriveKind drive) {
  std::vector<const EffectInfo*> causes;
  for (const EffectInfo& info : DeclaredEffects(drive)) {
    if (info.role == Role::kCause) causes.push_back(&info);
  }
  return causes;
}

const EffectInfo* FindDeclared(const std::string& id, DriveKind drive) {
  const std::vector<EffectInfo>& declared = DeclaredEffects(drive);
  const auto info = std::find_if(declared.begin(), declared.end(),
                                 [&](const EffectInfo& candidate) { return candidate.id == id; });
  return info == declared.end() ? nullptr : &*info;
}

const EffectInfo* FindDeclared(const std::string& id) {
  const EffectInfo* info = FindDeclared(id, DriveKind::kImu);
  return info != nullptr ? info : FindDeclared(id, DriveKind::kRotors);
}

const EffectInfo& InfoOf(const std::string& id) {
  const EffectInfo* info = FindDeclared(id);
  CHECK(info != nullptr) << "no effect is called " << id;
  return *info;
}

const EffectInfo& InfoOf(const Effect& effect) {
  return effect.term ? TermInfo(effect.term->on) : InfoOf(effect.id);
}

bool IsOfOneFlight(const Effect& effect) {
  if (!effect.term) return InfoOf(effect).of_one_flight;
  return std::ranges::any_of(
      effect.term->with, [](const TermFactor& factor) { return factor.of == TermQuantity::kTime; });
}

std::string AfterNumber(const std::string& unit) { return unit == "1" ? "" : " " + unit; }

std::string InWords(const Effect& effect) {
  if (effect.term) return effect.term->Text(effect["size"], effect["sigma"]);
  const EffectInfo& info = InfoOf(effect);
  std::vector<std::string> values;
  const auto add = [&](const std::string& name, const std::string& unit) {
    values.push_back(fmt::format("{} {:.3g}{}", name, effect[name], AfterNumber(unit)));
  };
  for (const EffectIndexInfo& index : info.indices) add(index.name, index.unit);
  for (const EffectParameterInfo& parameter : info.parameters) add(parameter.name, parameter.unit);
  return fmt::format("{} ({})", effect.id, fmt::join(values, ", "));
}

std::string NameOf(EntersAt enters) {
  switch (enters) {
    case EntersAt::kForce:
      return "force";
    case EntersAt::kAttitude:
      return "attitude";
    case EntersAt::kAccelerometer:
      return "accelerometer";
    case EntersAt::kThrust:
      return "thrust";
    case EntersAt::kLoad:
      return "load";
    case EntersAt::kFix:
      break;
  }
  return "fix";
}

const Eigen::Quaterniond& AttitudeNear(const FlightLog& log, TimeNs t) {
  const auto after = std::ranges::lower_bound(log.attitude, t, {}, &AttitudeSample::t);
  return after == log.attitude.end() ? log.attitude.back().q_Ep_I : after->q_Ep_I;
}

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
