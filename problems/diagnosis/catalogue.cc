#include "problems/diagnosis/catalogue.h"

#include <fmt/format.h>

#include <set>

namespace trueline {
namespace {

// The gate numbers that occur in fixes.
std::set<int> GatesSeen(const FlightLog& log) {
  std::set<int> gates;
  for (const Fix& fix : log.fixes) {
    if (fix.gate >= 0) gates.insert(fix.gate);
  }
  return gates;
}

bool Applies(const EffectInfo& info, const FlightLog& log, const CandidateScope& scope) {
  if (info.enters == EntersAt::kAttitude && !scope.attitude) return false;
  if (info.enters == EntersAt::kAccelerometer && !scope.accelerometer) return false;
  // Without the accelerometer's x and y a wind cannot be distinguished from a tilt of E'.
  if (info.id == "wind" && !scope.drag_measured) return false;
  const bool needs_map = info.id == "fix_scale" || info.id == "camera_misalignment";
  if (needs_map && log.gates.empty()) return false;
  return info.enters != EntersAt::kFix || !GatesSeen(log).empty();
}

}  // namespace

const std::vector<const EffectInfo*>& Catalogue() {
  static const std::vector<const EffectInfo*> catalogue = CausesOf(DriveKind::kImu);
  return catalogue;
}

Effect Candidate::At(const Eigen::VectorXd& parameters) const {
  Effect effect{info->id, fixed};
  for (std::size_t i = 0; i < info->parameters.size(); ++i) {
    effect.values[info->parameters[i].name] = parameters[static_cast<int>(i)];
  }
  return effect;
}

Eigen::VectorXd Candidate::Neutral() const {
  Eigen::VectorXd neutral(info->parameters.size());
  for (int i = 0; i < neutral.size(); ++i) neutral[i] = info->parameters[i].neutral;
  return neutral;
}

Eigen::VectorXd Candidate::Ordinary() const {
  Eigen::VectorXd ordinary(info->parameters.size());
  for (int i = 0; i < ordinary.size(); ++i) ordinary[i] = info->parameters[i].ordinary;
  return ordinary;
}

std::string Candidate::Label() const {
  if (fixed.count("gate") > 0) return fmt::format("{} {}", info->id, fixed.at("gate"));
  if (fixed.count("rotor") > 0) return fmt::format("{} {}", info->id, fixed.at("rotor"));
  if (fixed.count("t_step") > 0) return fmt::format("{} {:.1f} s", info->id, fixed.at("t_step"));
  return info->id;
}

std::vector<Candidate> CandidatesFor(const FlightLog& log, const CandidateScope& scope) {
  constexpr int kSteps = 12;  // times tried for a step effect; a refit refines the best one
  std::vector<Candidate> candidates;
  for (const EffectInfo* declared : Catalogue()) {
    const EffectInfo& info = *declared;
    if (!Applies(info, log, scope) || info.id == "false_gate") continue;
    if (info.HasIndex("gate")) {
      const std::set<int> gates = GatesSeen(log);
      // With a single gate, moving it only moves the origin.
      if (gates.size() < 2) continue;
      for (const int gate : gates) candidates.push_back({&info, {{"gate", gate}}});
    } else if (info.HasIndex("t_step")) {
      for (int k = 1; k <= kSteps; ++k) {
        candidates.push_back({&info, {{"t_step", scope.duration * k / (kSteps + 1)}}});
      }
    } else {
      candidates.push_back({&info, {}});
    }
  }
  return candidates;
}

}  // namespace trueline
