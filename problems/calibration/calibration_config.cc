#include "problems/calibration/calibration_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "problems/calibration/own_model.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/effects/read_effects.h"

namespace trueline {
namespace {

int ParseGamma(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 1) {
    throw InputError(fmt::format("'{}' is not a window length; give whole numbers from 1", text));
  }
  return value;
}

std::vector<std::string> ParseEstimators(const std::string& text) {
  std::vector<std::string> names = SplitList(text);
  for (const std::string& name : names) {
    FindEstimator(name);
    if (std::count(names.begin(), names.end(), name) > 1) {
      throw InputError(fmt::format("--estimator names '{}' twice", name));
    }
  }
  if (names.empty()) throw InputError("--estimator names no estimator");
  return names;
}

// Force effects need an air speed; the models of EKF and VGD-kinematic have none.
void CheckForces(const ForceEffects& forces, const std::vector<std::string>& estimators) {
  if (!forces.Any()) return;
  for (const std::string& name : estimators) {
    if (FindEstimator(name).force_effects) continue;
    throw InputError(fmt::format(
        "--model holds aerodynamic effects, which '{}' does not take; use vgd or smoother", name));
  }
}

ThrustSource ParseThrust(const std::string& text) {
  std::vector<std::string> names;
  for (const auto& [name, source] : kThrustSources) {
    if (text == name) return source;
    names.emplace_back(name);
  }
  const std::string last = names.back();
  names.pop_back();
  throw InputError(
      fmt::format("--thrust={} is not known; use {} or {}", text, fmt::join(names, ", "), last));
}

}  // namespace

CalibrationOptions ResolveCalibrationOptions(const CalibrationFlags& flags) {
  CalibrationOptions options;
  if (!flags.config.empty()) {
    options.methods = FromYaml<EstimatorOptions>(YamlMap::FromFile(flags.config));
  }
  VgdOptions& vgd = options.methods.vgd;
  if (!flags.model.empty()) {
    if (vgd.ranges != RangeUse::kPrior) {
      throw InputError(
          fmt::format("--model={} is a prior, and {} fits without one; use 'ranges: prior', or "
                      "leave --model out",
                      flags.model, flags.config));
    }
    options.priors_without_model = vgd.priors;
    options.effects = ApplyModel(flags.model, &vgd);
  }
  options.estimators = ParseEstimators(flags.estimators);
  if (flags.gamma != 0) vgd.gamma = ParseGamma(std::to_string(flags.gamma));
  if (!flags.thrust.empty()) vgd.drive.thrust = ParseThrust(flags.thrust);
  options.gamma_sweep.clear();
  for (const std::string& gamma : SplitList(flags.gamma_sweep)) {
    options.gamma_sweep.push_back(ParseGamma(gamma));
  }
  return options;
}

void CheckOtherLogs(const std::vector<FlightLog>& others, const CalibrationOptions& options) {
  const auto whole = [](const std::string& name) { return FindEstimator(name).whole_flight; };
  const auto& names = options.estimators;
  if (others.empty() || std::any_of(names.begin(), names.end(), whole)) return;
  throw InputError(
      "only the smoother takes several logs: give one with --log, or --estimator=smoother");
}

std::vector<Effect> ApplyModel(const std::string& model_file, VgdOptions* options) {
  const YamlMap model = YamlMap::FromFile(model_file);
  std::vector<Effect> effects = ReadEffects(model);
  options->drive.force_effects = ForceEffectsOf(effects);
  const YamlMap parameters = model.Child("parameters");
  for (int i = 0; i < kMotionSize; ++i) {
    if (!IsVehicle(i)) continue;
    if (!parameters.Has(kTheta[i].name) && parameters.Has("I_x")) {
      parameters.Fail("I_x",
                      "is a constant of the rotor-driven model: give --drive=rotors, or the "
                      "model.yaml of a calibration without it");
    }
    const YamlMap entry = parameters.Child(kTheta[i].name);
    ParameterPrior& prior = options->priors[i];
    prior.mean = std::clamp(entry.Get<double>("value"), prior.lower + 1e-9, prior.upper - 1e-9);
    prior.sigma = entry.Get<double>("sigma");
    if (!(prior.sigma > 0.0)) entry.Fail("sigma", "must be a finite number above zero");
    if (entry.Get<std::string>("unit") != kTheta[i].unit) {
      entry.Fail("unit", fmt::format("must be {}", kTheta[i].unit));
    }
  }
  return effects;
}

void LimitModelTo(const std::vector<FlightLog>& logs, const std::string& model_file,
                  CalibrationOptions* options) {
  if (model_file.empty()) return;
  VgdOptions& vgd = options->methods.vgd;
  const MotionPriors& without_model = *options->priors_without_model;
  for (const std::string& changed :
       LeaveOutOtherFlights(model_file, logs, &options->effects, &options->warnings)) {
    for (int i = 0; i < kMotionSize; ++i) {
      if (kTheta[i].name == changed) vgd.priors[i] = without_model[i];
    }
  }
  vgd.drive.force_effects = ForceEffectsOf(options->effects);
  CheckForces(vgd.drive.force_effects, options->estimators);
  const auto own = [&](const FlightLog& log) { return IsFittedTo(model_file, log); };
  if (std::none_of(logs.begin(), logs.end(), own)) return;
  vgd.priors = without_model;
  options->priors_without_model.reset();
  options->warnings.push_back(OwnModelWarning(model_file));
}

YAML::Node ToYaml(const CalibrationOptions& options) {
  YAML::Node node = ToYaml(options.methods);
  node["estimators"] = options.estimators;
  node["gamma_sweep"] = options.gamma_sweep;
  node["gamma_sweep"].SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

}  // namespace trueline
