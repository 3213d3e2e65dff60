// The catalogue of effects that a diagnosis of the IMU-driven model tests: one declaration each.
#pragma once

#include <string>
#include <vector>

#include "problems/effects/effect.h"

namespace trueline {

enum class EntersAt { kForce, kAttitude, kAccelerometer, kFix, kThrust, kLoad };

struct EffectParameterInfo {
  std::string name;
  std::string unit;
  double step;              // of the difference quotient that gives the sensitivity
  double plausible;         // largest size that a real vehicle has
  double ordinary;          // size that every vehicle has, too small to be called a cause
  bool either_sign = true;  // both signs are physical
  double neutral = 0.0;
};

struct EffectInfo {
  std::string id;
  EntersAt enters;
  std::vector<EffectParameterInfo> parameters;  // the estimated ones
  std::string physics;                          // one sentence
  std::string separate_by;                      // manoeuvre that separates it from similar effects
};

const std::vector<EffectInfo>& Catalogue();
const EffectInfo& InfoOf(const std::string& id);  // id must be in the catalogue
std::string NameOf(EntersAt enters);

// One hypothesis about a flight: an effect with its discrete parameters (gate, t_step) fixed.
struct Candidate {
  const EffectInfo* info;
  std::map<std::string, double> fixed;

  // The effect with these values of the estimated parameters, the others neutral.
  Effect At(const Eigen::VectorXd& parameters) const;
  Eigen::VectorXd Neutral() const;
  Eigen::VectorXd Ordinary() const;  // sizes that every vehicle has
  std::string Label() const;         // id, with gate or time where there is one
};

struct CandidateScope {
  bool accelerometer;  // thrust is measured by the accelerometer
  bool drag_measured;  // accelerometer x and y are measurements
  bool attitude;       // logged, so that effects on it can be undone
  double duration;     // s, of the log
};

// All candidates for a flight: each effect; a moved gate for each gate; drag steps at several
// times.
std::vector<Candidate> CandidatesFor(const FlightLog& log, const CandidateScope& scope);

}  // namespace trueline
