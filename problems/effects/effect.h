// Effects beyond the calibrated model, with their values, as in model.yaml and as trueline-diagnose
// finds them. Names, signs and units are those of the catalogue of effects.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cost_functions/models/force_effects.h"
#include "problems/effects/term.h"
#include "problems/log/flight_log.h"

namespace trueline {

struct Effect {
  std::string id;
  std::map<std::string, double> values;  // by parameter, in the catalogue's units
  // Of a term of the open catalogue, whose id is "term" and whose only parameter is "size".
  std::shared_ptr<const TermForm> term = nullptr;

  double operator[](const std::string& name) const {
    const auto it = values.find(name);
    return it == values.end() ? 0.0 : it->second;
  }
};

// The aerodynamic force effects, which the model integrates.
ForceEffects ForceEffectsOf(const std::vector<Effect>& effects);

// Velocity over ground along a fitted path, ascending in time.
struct VelocitySample {
  TimeNs t;
  Eigen::Vector3d v_E;                            // m/s
  Eigen::Vector3d p_E = Eigen::Vector3d::Zero();  // m, for terms that go with a place
};

// The log corrected for the effects on sensors, attitude filter, detector and map: each is removed
// with its stated values. `path` is for effects that depend on the vehicle's acceleration; if it is
// empty, lines and curves through the fixes replace it.
FlightLog CorrectLog(const FlightLog& log, const std::vector<Effect>& effects,
                     const std::vector<VelocitySample>& path = {});

}  // namespace trueline
