// Effects beyond the calibrated model, with their values, as in model.yaml and as trueline-diagnose
// finds them. Names, signs and units are those of the catalogue of effects.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cost_functions/models/force_effects.h"
#include "cost_functions/models/term_force.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Terms of the open catalogue as data: what a term changes, along which axis, and what it goes
// with. Each has a name in words, and symbols for model.yaml: `where: force_x`, `with: q*v_x`.

// A product of factors in symbols ("abs(v_x)*T(9.81)"), words and unit.
std::string SymbolsOf(const std::vector<TermFactor>& factors);
std::string WordsOf(const std::vector<TermFactor>& factors);
std::string UnitOf(const std::vector<TermFactor>& factors);
// How long the formula is: the factors in it.
int LengthOf(const std::vector<TermFactor>& factors);
// True for a part of the course.
bool IsLocal(const std::vector<TermFactor>& factors);

struct TermForm {
  TermOn on = TermOn::kForce;
  int axis = 0;  // 0 to 2: x, y, z of B; 3, 4, 5: north, east, down; 6: to the gate
  std::vector<TermFactor> with = {};

  std::string Where() const;   // force_x, ..., attitude_roll, fix_north
  std::string Name() const;    // "force along x_B with pitch rate"
  std::string Enters() const;  // force | moment | attitude | fix
  std::string Along() const;   // x_B, ..., north, ...
  std::string Unit() const;    // of its size: "m/s^2 for each rad/s"
  // "a force along x_B of 1.5 +- 0.2 m/s^2 for each rad/s of pitch rate"
  std::string Text(double size, double sigma) const;
  // A force that goes with the vehicle mostly turns with it, too.
  int Length() const { return 2 * LengthOf(with) + (axis < 3 ? 0 : 1); }

  SizedTerm Sized(double size) const { return {on, axis, with, size}; }
  // One unit of it, in body axes. Factors that need a series must have one.
  Eigen::Vector3d At(const TermState<double>& state) const { return Sized(1.0).InBody(state); }
};

// The form of these symbols. Throws TermError, which says what is known.
struct TermError {
  std::string key, text;
};
TermForm ParseTerm(const std::string& where, const std::string& with);

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
