// Every effect is declared once: what it is called, its parameters, its physics, the manoeuvre that
// shows it, and what estimators do about it. Readers of model.yaml, the diagnosis, the
// calibration's `consider`, `trueline effects` and the blind sets derive from these declarations.
// (The simulator has physics of its own.)
#pragma once

#include <string>
#include <vector>

#include "cost_functions/models/rotor_effects.h"
#include "problems/common/strict_yaml.h"
#include "problems/effects/effect.h"
#include "problems/rotor/rotor_state.h"
#include "problems/vgd/attitude_errors.h"

namespace trueline {

// Effects of a rotor-driven flight, by id as in model.yaml, converted to changes of the model, of
// its constants (linear drag and inflow are constants of RotorAeroModel) or of the rotors' input.
struct RotorExtension {
  RotorEffects effects;
  RotorConstants added = RotorConstants::Zero();  // to the constants
  double motor_lag = 0.0;                         // s

  void Add(const std::string& constant, double value);
};

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
  // The constant of the rotor-driven model that states the same. Where a fit estimates it, the
  // effect is in the model already.
  std::string constant = {};
};

// A parameter that is not estimated: one hypothesis for each of its values (gate, rotor, t_step).
struct EffectIndexInfo {
  std::string name;
  std::string unit;
};

// A size that the blind sets hide: drawn log-uniformly from `low` to `high`, with either sign.
struct DrawnSize {
  std::string name;
  double low, high;
  bool either_sign = false;
};

// What the correction of a log depends on.
struct CorrectionContext {
  const FlightLog& original;
  const std::vector<VelocitySample>& path;  // as in CorrectLog

  double Since(TimeNs t) const { return SecondsBetween(original.imu.front().t, t); }
  // `path`, or every quarter of a second by lines and curves through the fixes.
  std::vector<VelocitySample> Path() const;
};
// Corrections are made in this order: later ones use the corrected samples.
enum class CorrectionStage { kClock, kImu, kAttitude, kMap, kGateVector, kFixClock };

struct EffectInfo {
  std::string id;
  EntersAt enters;
  std::vector<EffectParameterInfo> parameters;  // the estimated ones
  std::string physics;                          // one sentence
  std::string definition;        // sign and size; f_B specific force, v_B air-relative velocity
  std::string separate_by = {};  // manoeuvre that separates it from similar effects
  std::vector<EffectIndexInfo> indices = {};
  Role role = Role::kCause;
  bool enters_squared = false;  // forces are linear in the square of the parameter
  // The error grows with time, as that of a random walk may: noise that is learned without the
  // effect explains it.
  bool drifts = false;
  std::vector<DrawnSize> drawn = {};  // in the order in which they are drawn; none: never hidden
  // What estimators do: add a force that the IMU-driven model integrates, remove the effect from
  // the log, or extend the rotor-driven model. None: their robust loss copes with it.
  void (*add_force)(const Effect&, ForceEffects*) = nullptr;
  CorrectionStage correct_at = CorrectionStage::kClock;
  void (*correct)(const Effect&, const CorrectionContext&, FlightLog*) = nullptr;
  void (*extend)(const Effect&, RotorExtension*) = nullptr;
  // The ordinary error of the attitude filter that the effect takes the place of.
  double AttitudeErrorPriors::*replaces = nullptr;
  // Another flight of the vehicle lacks the effect, or has it at another size or time.
  bool of_one_flight = false;
  // Constants of the vehicle that the effect changes for good: those of the fit hold before it.
  std::vector<std::string> changes = {};

  bool HasIndex(const std::string& name) const;
  // Names of all parameters, indices first.
  std::vector<std::string> ParameterNames() const;
};

const std::vector<EffectInfo>& DeclaredEffects(DriveKind drive);
// The effects of a drive that can be named as a cause.
std::vector<const EffectInfo*> CausesOf(DriveKind drive);
// Null for an unknown id; of either drive, or of one.
const EffectInfo* FindDeclared(const std::string& id);
const EffectInfo* FindDeclared(const std::string& id, DriveKind drive);
// CHECKs that `id` is declared.
const EffectInfo& InfoOf(const std::string& id);
// For a term of the open catalogue: TermInfo of what the term changes.
const EffectInfo& InfoOf(const Effect& effect);
// What estimators do about terms of the open catalogue that change `on`; id "term", parameter size.
const EffectInfo& TermInfo(TermOn on);

// True if another flight of the vehicle lacks the effect, or has it at another size or time. A term
// of the open catalogue does so if it goes with time.
bool IsOfOneFlight(const Effect& effect);
// " m/s"; nothing for the unit 1.
std::string AfterNumber(const std::string& unit);
// "wind (w_x 2.9 m/s, w_y -2 m/s)".
std::string InWords(const Effect& effect);

std::string NameOf(EntersAt enters);

// Attitude at the first sample from t on; accurate enough to rotate small, slowly varying vectors.
// There must be a sample.
const Eigen::Quaterniond& AttitudeNear(const FlightLog& log, TimeNs t);

RotorExtension RotorExtensionOf(const std::vector<Effect>& effects);
// What they change in the model; terms take from the log what they need.
RotorEffects RotorEffectsOn(const FlightLog& log, const std::vector<Effect>& effects);

// The lists, each in a file of its own.
std::vector<EffectInfo> ForceDeclarations();
std::vector<EffectInfo> AccelerometerDeclarations();
std::vector<EffectInfo> AttitudeDeclarations();
std::vector<EffectInfo> FixDeclarations();
std::vector<EffectInfo> RotorDrivenDeclarations();

// The effects of a model.yaml.

// The list under `effects:`, each {id: ..., parameter: value, ...}. Throws InputError for an id
// that is not declared for the drive, for parameters that are left out or misspelt, and for values
// that are not finite numbers. A term of the open catalogue is {id: term, where: force_x, with: q,
// size: 0.3, unit: m/s^2 for each rad/s}; unknown symbols and another unit are errors.
std::vector<Effect> ReadEffects(const YamlMap& model, DriveKind drive = DriveKind::kImu);

// A term among them; whether a model takes it is for the caller.
Effect ReadTerm(const YamlMap& entry);
// An entry of that list.
YAML::Node ToYaml(const Effect& effect);
// That list; [] if it is empty.
YAML::Node EffectsNode(const std::vector<Effect>& effects);

}  // namespace trueline
