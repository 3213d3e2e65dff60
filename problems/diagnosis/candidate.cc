#include "problems/diagnosis/candidate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trueline {

constexpr int kSteps = 12;  // times tried for a step effect; the best one is refined

Eigen::VectorXd EachOf(const std::vector<EffectParameterInfo>& parameters,
                       double EffectParameterInfo::*what) {
  Eigen::VectorXd all(std::ssize(parameters));
  std::ranges::transform(parameters, all.begin(), what);
  return all;
}

Candidate Candidate::OfTerm(const TermForm& form, double step) {
  auto info = std::make_shared<EffectInfo>(TermInfo(form.on));
  info->parameters.front().step = step;
  Candidate candidate{info.get(), {}, std::make_shared<TermForm>(form)};
  candidate.own = std::move(info);
  return candidate;
}

Effect Candidate::At(const Eigen::VectorXd& parameters) const {
  Effect effect{info->id, fixed, term};
  for (int i = 0; i < size(); ++i) effect.values[info->parameters[i].name] = parameters[i];
  return effect;
}

std::string Candidate::Label() const {
  if (fixed.count("gate") > 0) return fmt::format("{} {}", info->id, fixed.at("gate"));
  if (fixed.count("rotor") > 0) return fmt::format("{} {}", info->id, fixed.at("rotor"));
  if (IsStep()) return fmt::format("{} {:.1f} s", info->id, fixed.at("t_step"));
  return info->id;
}

std::vector<Effect> EffectsOf(const std::vector<Found>& found) {
  std::vector<Effect> effects;
  effects.reserve(found.size());
  for (const Found& f : found) effects.push_back(f.effect());
  return effects;
}

double CatalogueScope::StepSpacing() const { return duration / (kSteps + 1); }

std::vector<Candidate> CandidatesFor(DriveKind drive, const CatalogueScope& scope) {
  std::vector<Candidate> candidates;
  for (const EffectInfo* info : CausesOf(drive)) {
    if (!scope.applies(*info)) continue;
    if (info->HasIndex("gate")) {
      if (scope.gates.size() < 2) continue;
      for (const int gate : scope.gates) candidates.push_back({info, {{"gate", gate}}});
    } else if (info->HasIndex("rotor")) {
      for (int i = 0; i < scope.rotors; ++i) candidates.push_back({info, {{"rotor", i}}});
    } else if (info->HasIndex("t_step")) {
      for (int k = 1; k <= kSteps; ++k) {
        candidates.push_back({info, {{"t_step", scope.start + k * scope.StepSpacing()}}});
      }
    } else {
      candidates.push_back({info, {}});
    }
  }
  return candidates;
}

bool IsOneOf(const Candidate& a, const Candidate& b) {
  return a.info == b.info && (a.fixed.empty() || a.IsStep() || a.fixed == b.fixed);
}

std::vector<Candidate> Without(std::vector<Candidate> candidates, const std::vector<Found>& found) {
  std::erase_if(candidates, [&](const Candidate& c) {
    return std::ranges::any_of(found, [&](const Found& f) { return IsOneOf(c, f.candidate); });
  });
  return candidates;
}

double ShareLeft(const Eigen::VectorXd& part, const Eigen::VectorXd& whole,
                 const Eigen::VectorXd& unit) {
  const Eigen::VectorXd sizes = whole.cwiseQuotient(unit);
  return sizes.dot(part.cwiseQuotient(unit)) / sizes.squaredNorm();
}

bool Plausible(const Candidate& candidate, const Eigen::VectorXd& value) {
  for (int i = 0; i < value.size(); ++i) {
    const EffectParameterInfo& info = candidate.info->parameters[i];
    if (std::abs(value[i]) >= info.plausible) return false;
    if (!info.either_sign && value[i] < 0.0) return false;
  }
  return true;
}

int DistinctIds(const std::vector<Candidate>& candidates) {
  std::set<std::string> ids;
  for (const Candidate& c : candidates) ids.insert(c.id());
  return static_cast<int>(ids.size());
}

}  // namespace trueline
