// Effects of a rotor-driven flight, by id as in model.yaml, converted to changes of the model, of
// its constants (linear drag and inflow are constants of RotorAeroModel) or of the rotors' input.
#pragma once

#include <string>
#include <vector>

#include "cost_functions/models/rotor_effects.h"
#include "problems/effects/effect.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

struct RotorExtension {
  RotorEffects effects;
  RotorConstants added = RotorConstants::Zero();  // to the constants
  double motor_lag = 0.0;                         // s

  void Add(const std::string& constant, double value);
};

RotorExtension RotorExtensionOf(const std::vector<Effect>& effects);
// What they change in the model; terms take from the log what they need.
RotorEffects RotorEffectsOn(const FlightLog& log, const std::vector<Effect>& effects);

}  // namespace trueline
