// Every effect is declared once: what it is called, its parameters, its physics, and the manoeuvre
// that shows it. Readers of model.yaml, both diagnoses, the calibration's `consider` and
// `trueline effects` derive from these declarations. (The simulator has physics of its own.)
#pragma once

#include <string>
#include <vector>

namespace trueline {

enum class EntersAt { kForce, kAttitude, kAccelerometer, kFix, kThrust, kLoad };
enum class DriveKind { kImu, kRotors };
// A cause can be named; a nuisance is an error that every vehicle has to some extent.
enum class Role { kCause, kNuisance };

struct EffectParameterInfo {
  std::string name;
  std::string unit;
  double step;              // of the difference quotient that gives the sensitivity
  double plausible;         // largest size that a real vehicle has
  double ordinary;          // size that every vehicle has, too small to be called a cause
  bool either_sign = true;  // both signs are physical
  double neutral = 0.0;
};

// A parameter that is not estimated: one hypothesis for each of its values (gate, rotor, t_step).
struct EffectIndexInfo {
  std::string name;
  std::string unit;
};

struct EffectInfo {
  std::string id;
  EntersAt enters;
  std::vector<EffectParameterInfo> parameters;  // the estimated ones
  std::string physics;                          // one sentence
  std::string definition;   // sign and size; f_B specific force, v_B air-relative velocity
  std::string separate_by;  // manoeuvre that separates it from similar effects
  std::vector<EffectIndexInfo> indices = {};
  Role role = Role::kCause;
  bool enters_squared = false;  // forces are linear in the square of the parameter

  bool HasIndex(const std::string& name) const;
  // Names of all parameters, indices first.
  std::vector<std::string> ParameterNames() const;
};

const std::vector<EffectInfo>& DeclaredEffects(DriveKind drive);
// The effects of a drive that can be named as a cause.
std::vector<const EffectInfo*> CausesOf(DriveKind drive);
// Of either drive; null for an unknown id.
const EffectInfo* FindDeclared(const std::string& id);
// CHECKs that `id` is declared.
const EffectInfo& InfoOf(const std::string& id);

std::string NameOf(EntersAt enters);

// The lists, each in a file of its own.
std::vector<EffectInfo> ImuDrivenDeclarations();
std::vector<EffectInfo> RotorDrivenDeclarations();

}  // namespace trueline
