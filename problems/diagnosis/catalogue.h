// The hypotheses that a diagnosis of the IMU-driven model tests.
#pragma once

#include <string>
#include <vector>

#include "problems/effects/declaration.h"
#include "problems/effects/effect.h"

namespace trueline {

// The effects that the diagnosis of the IMU-driven model tests.
const std::vector<const EffectInfo*>& Catalogue();

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
