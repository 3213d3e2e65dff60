#include "problems/rotor_diagnosis/rotor_catalogue.h"

#include <algorithm>

namespace trueline {
namespace {

constexpr int kSteps = 12;  // times tried for a step effect; the best is refined

// Lowest height of the flight above the floor (p_z = 0), m.
double LowestHeight(const RotorData& data) {
  double lowest = -data.poses.front().p_E.z();
  for (const RotorPose& pose : data.poses) lowest = std::min(lowest, -pose.p_E.z());
  return lowest;
}

bool InBase(const RotorPrior& prior, const std::string& constant) {
  return prior.sigma[FindRotorConstant(constant)] > 0.0;
}

bool Applies(const std::string& id, const RotorData& data, const RotorPrior& prior) {
  constexpr double kOnTheFloor = 0.02;  // m
  if (id == "linear_drag") return !InBase(prior, "K_x") && !InBase(prior, "K_z");
  if (id == "rotor_inflow") return !InBase(prior, "inflow");
  if (id == "motor_lag") return !data.motors;  // with commands the base fit estimates it
  return id != "ground_effect" || LowestHeight(data) > kOnTheFloor;
}

double Length(const RotorData& data) { return data.poses.back().t - data.poses.front().t; }

}  // namespace

const std::vector<const EffectInfo*>& RotorCatalogue() {
  static const std::vector<const EffectInfo*> catalogue = CausesOf(DriveKind::kRotors);
  return catalogue;
}

bool IsStep(const Candidate& candidate) { return candidate.fixed.count("t_step") > 0; }

double StepSpacing(const RotorData& data) { return Length(data) / (kSteps + 1); }

std::vector<Candidate> RotorCandidatesFor(const RotorData& data, int rotors,
                                          const RotorPrior& prior) {
  std::vector<Candidate> candidates;
  for (const EffectInfo* declared : RotorCatalogue()) {
    const EffectInfo& info = *declared;
    if (!Applies(info.id, data, prior)) continue;
    if (info.HasIndex("rotor")) {
      for (int i = 0; i < rotors; ++i) candidates.push_back({&info, {{"rotor", i}}});
    } else if (info.HasIndex("t_step")) {
      const double start = data.since_start + data.poses.front().t;
      for (int k = 1; k <= kSteps; ++k) {
        candidates.push_back({&info, {{"t_step", start + k * StepSpacing(data)}}});
      }
    } else {
      candidates.push_back({&info, {}});
    }
  }
  return candidates;
}

std::vector<Candidate> StepsAround(const Candidate& candidate, double range, int count) {
  std::vector<Candidate> candidates;
  for (int k = 0; k < count; ++k) {
    const double shift = range * (2.0 * k / (count - 1) - 1.0);
    candidates.push_back({candidate.info, {{"t_step", candidate.fixed.at("t_step") + shift}}});
  }
  return candidates;
}

}  // namespace trueline
