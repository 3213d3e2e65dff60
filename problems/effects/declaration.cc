#include "problems/effects/declaration.h"

#include <glog/logging.h>

#include <algorithm>

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

}  // namespace trueline
