// The hypotheses that a diagnosis tests on a flight.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "problems/effects/declaration.h"
#include "problems/effects/effect.h"

namespace trueline {

Eigen::VectorXd EachOf(const std::vector<EffectParameterInfo>& parameters,
                       double EffectParameterInfo::*what);

// An effect with its discrete parameters (gate, rotor, t_step) fixed.
struct Candidate {
  const EffectInfo* info;
  std::map<std::string, double> fixed;
  std::shared_ptr<const TermForm> term = nullptr;   // of the open catalogue
  std::shared_ptr<const EffectInfo> own = nullptr;  // of a term: owns `info`

  // A term whose size changes by steps of `step`.
  static Candidate OfTerm(const TermForm& form, double step);

  const std::string& id() const { return info->id; }
  int size() const { return static_cast<int>(info->parameters.size()); }
  bool IsFalseGate() const { return id() == "false_gate"; }  // no linear effect; see false_gate.h
  bool IsStep() const { return fixed.count("t_step") > 0; }
  // The effect with these values of the estimated parameters.
  Effect At(const Eigen::VectorXd& parameters) const;
  // Of each estimated parameter.
  Eigen::VectorXd EachOf(double EffectParameterInfo::*what) const {
    return trueline::EachOf(info->parameters, what);
  }
  Eigen::VectorXd Neutral() const { return EachOf(&EffectParameterInfo::neutral); }
  // Sizes that every vehicle has.
  Eigen::VectorXd Ordinary() const { return EachOf(&EffectParameterInfo::ordinary); }
  std::string Label() const;  // id, with gate, rotor or time where there is one
  bool operator==(const Candidate& other) const {
    return info == other.info && fixed == other.fixed;
  }
};

// A cause whose value is being refined.
struct Found {
  Candidate candidate;
  Eigen::VectorXd value;
  double p = 1.0;                          // corrected for the number of effects tried
  std::vector<std::string> confused = {};  // ids that fit as well

  Effect effect() const { return candidate.At(value); }
  bool operator==(const Found& other) const {
    return candidate == other.candidate && value == other.value;
  }
};
std::vector<Effect> EffectsOf(const std::vector<Found>& found);

// The part of the catalogue that a flight can show.
struct CatalogueScope {
  std::function<bool(const EffectInfo&)> applies;
  std::set<int> gates;  // seen; a single gate cannot be moved: that only moves the origin
  int rotors = 0;
  double start = 0.0;     // s, of the flight, from the log's first IMU sample
  double duration = 0.0;  // s

  double StepSpacing() const;  // s, between the times tried for a step effect
};

// Each effect; a moved gate for each gate, a loss for each rotor, step effects at several times.
std::vector<Candidate> CandidatesFor(DriveKind drive, const CatalogueScope& scope);

// True if a flight has only one of both: the same effect, of the same gate or rotor, at any time.
bool IsOneOf(const Candidate& a, const Candidate& b);

// Removes those that are in the model. Another gate or rotor may still be added, another time of a
// step effect may not.
std::vector<Candidate> Without(std::vector<Candidate> candidates, const std::vector<Found>& found);

// How much of the size `whole` is in `part`, both in these units; 1: all.
double ShareLeft(const Eigen::VectorXd& part, const Eigen::VectorXd& whole,
                 const Eigen::VectorXd& unit);

// True if the value is within the range of real vehicles and of a physical sign.
bool Plausible(const Candidate& candidate, const Eigen::VectorXd& value);

template <class Item>
void EraseAt(std::size_t i, std::vector<Item>* items) {
  items->erase(items->begin() + static_cast<long>(i));
}

int DistinctIds(const std::vector<Candidate>& candidates);

}  // namespace trueline
