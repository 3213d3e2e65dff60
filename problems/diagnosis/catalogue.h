// The catalogue of effects that a diagnosis of the IMU-driven model looks for: one declaration
// each.
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
  bool either_sign = true;  // physics allows both
  double neutral = 0.0;
};

struct EffectInfo {
  std::string id;
  EntersAt enters;
  std::vector<EffectParameterInfo> parameters;  // those that are estimated
  std::string physics;                          // one sentence
  std::string separate_by;                      // manoeuvre that tells it from what looks alike
};

const std::vector<EffectInfo>& Catalogue();
const EffectInfo& InfoOf(const std::string& id);  // id must be in the catalogue
std::string NameOf(EntersAt enters);

// One hypothesis about a flight: an effect with what is not estimated fixed (gate, t_step).
struct Candidate {
  const EffectInfo* info;
  std::map<std::string, double> fixed;

  // The effect with its estimated parameters neutral, apart from those given.
  Effect At(const Eigen::VectorXd& parameters) const;
  Eigen::VectorXd Neutral() const;
  Eigen::VectorXd Ordinary() const;  // sizes that are no cause
  std::string Label() const;         // id, with gate or time where there is one
};

struct CandidateScope {
  bool accelerometer;  // the thrust comes from the accelerometer
  bool drag_measured;  // its x and y axes are data
  bool attitude;       // logged, so that effects on it can be undone
  double duration;     // s, of the log
};

// All candidates for a flight: each effect, moved gates by gate, drag steps by time.
std::vector<Candidate> CandidatesFor(const FlightLog& log, const CandidateScope& scope);

}  // namespace trueline
