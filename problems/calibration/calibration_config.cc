#include "problems/calibration/calibration_config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "problems/calibration/conflict.h"
#include "problems/calibration/considered.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/strict_yaml.h"
#include "problems/effects/declaration.h"

namespace trueline {
namespace {

constexpr char kStream[] = "imu.csv";

// The digests of the recordings that were fitted; none if the model does not state them.
std::set<std::string> FittedDigests(const std::string& model_file) {
  const YamlMap model = YamlMap::FromFile(model_file);
  std::set<std::string> digests;
  const auto add = [&](const YamlMap& of) {
    digests.insert(of.ChildOrEmpty("sha256").Get<std::string>(kStream, ""));
  };
  if (!model.Has("provenance")) return digests;
  const YamlMap provenance = model.Child("provenance");
  add(provenance);
  for (const YamlMap& further : provenance.Children("further")) add(further);
  digests.erase("");
  return digests;
}

bool IsAmong(const std::set<std::string>& digests, const FlightLog& log) {
  const auto of_log = log.sha256.find(kStream);
  return of_log != log.sha256.end() && digests.contains(of_log->second);
}

std::string LeftOutWarning(const std::string& model_file, const std::vector<Effect>& effects,
                           const std::set<std::string>& changed) {
  std::vector<std::string> words;
  words.reserve(effects.size());
  for (const Effect& effect : effects) words.push_back(InWords(effect));
  const std::string constants =
      changed.empty()
          ? ""
          : fmt::format("; the model's {} held before that, so the configuration's priors stay",
                        fmt::join(changed, " and "));
  return fmt::format(
      "{} was fitted to another flight, and what belongs to that flight is left out: {}{}. If this "
      "flight has it too, trueline diagnose without --model finds it",
      model_file, fmt::join(words, ", "), constants);
}

// True if model.yaml states that one of these recordings was fitted, alone or with others
// (provenance: the digests of imu.csv). Constants that were fitted to the flight itself are no
// prior knowledge about it.
bool IsOwn(const std::string& model_file, std::span<const FlightLog> logs) {
  const std::set<std::string> digests = FittedDigests(model_file);
  return std::ranges::any_of(logs, [&](const FlightLog& log) { return IsAmong(digests, log); });
}

// What to tell the user where the model's constants are left out for that reason.
std::string OwnModelWarning(const std::string& model_file) {
  return fmt::format(
      "{} was fitted to this very flight: its constants are not used as a prior, which would count "
      "the same data twice; its effects are. Give the model of another flight of the vehicle",
      model_file);
}

// Takes the effects of one flight, such as a wind, out of the model's `effects`, unless the model
// was fitted to all of `logs` or does not state what it was fitted to. Returns the names of
// constants that these effects changed, of which the model states the value before. A warning names
// both.
std::set<std::string> LeaveOutOtherFlights(const std::string& model_file,
                                           std::span<const FlightLog> logs,
                                           std::vector<Effect>* effects,
                                           std::vector<std::string>* warnings) {
  std::set<std::string> changed;
  const std::set<std::string> digests = FittedDigests(model_file);
  const auto own = [&](const FlightLog& log) { return IsAmong(digests, log); };
  if (digests.empty() || std::ranges::all_of(logs, own)) return changed;
  const auto others = std::stable_partition(effects->begin(), effects->end(),
                                            [](const Effect& e) { return !IsOfOneFlight(e); });
  const std::vector<Effect> left_out(others, effects->end());
  effects->erase(others, effects->end());
  if (left_out.empty()) return changed;
  for (const Effect& effect : left_out) {
    const std::vector<std::string>& names = InfoOf(effect).changes;
    changed.insert(names.begin(), names.end());
  }
  warnings->push_back(LeftOutWarning(model_file, left_out, changed));
  return changed;
}

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
  if (!IsOwn(model_file, logs)) return;
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

namespace {

RotorCalibrationOptions OptionsFromLog(const FlightLog& log) {
  std::string warning;
  RotorCalibrationOptions options(VehicleFromLog(log, &warning));
  options.warnings.push_back(warning);
  return options;
}

// Prior and rotor data both hold values of the motors' unknowns; the prior's values are copied.
void ShareMotors(RotorCalibrationOptions* options) {
  if (!options->data.motors) return;
  options->data.motors_at = MotorsOf(options->prior.mean);
}

void SerializeMotors(YamlArchive* a, MotorCurve* curve, MotorValues* at) {
  a->Positive("full_speed", &curve->full_speed);
  a->Positive("nominal_voltage", &curve->nominal_voltage);
  a->Positive("lag", &(*at)[kLag]);
  a->NotNegative("idle", &(*at)[kIdle]);
  a->Require((*at)[kIdle] < 1.0, "idle", "is a share of full_speed, below 1");
  a->NotNegative("voltage", &(*at)[kVoltage]);
}

void ReadMotors(const YamlMap& map, RotorCalibrationOptions* options) {
  RotorDataOptions& data = options->data;
  YamlArchive archive(map);
  SerializeMotors(&archive, &data.motors.emplace(), &data.motors_at);
  map.Finish();
  data.rotors = RotorSource::kMotors;
  options->prior.mean.segment<kMotorUnknowns>(FindRotorConstant("motor_lag")) = data.motors_at;
}

// A model's file (--model), or none, and what of it is taken.
struct RotorModelSource {
  std::string file;
  bool constants = true, effects = true;
};

// The earlier flight's estimates and sigmas become the prior; biases keep theirs, as do constants
// that the earlier flight ended with another value of. A model of the same flight gives its effects
// only.
void ApplyRotorModel(const RotorModelSource& source, std::span<const FlightLog> logs,
                     RotorCalibrationOptions* options) {
  if (source.file.empty()) return;
  const std::string& file = source.file;
  RotorPrior* prior = &options->prior;
  const YamlMap model = YamlMap::FromFile(file);
  const bool own = IsOwn(file, logs);
  if (own) options->warnings.push_back(OwnModelWarning(file));
  options->effects = ReadEffects(model, DriveKind::kRotors);
  const std::set<std::string> changed =
      LeaveOutOtherFlights(file, logs, &options->effects, &options->warnings);
  const YamlMap parameters = model.Child("parameters");
  for (const std::string& name : parameters.Keys()) {
    const int i = FindRotorConstant(name);
    if (i < 0) {
      parameters.Fail(name,
                      "is no constant of the rotor-driven model; --model needs the "
                      "model.yaml of a calibration with --drive=rotors");
    }
    const bool bias = kRotorConstants[i].group == RotorConstantGroup::kBias;
    if (!source.constants || own || bias || changed.contains(name)) continue;
    const YamlMap entry = parameters.Child(name);
    prior->mean[i] = entry.Get<double>("value");
    prior->sigma[i] = entry.Get<double>("sigma");
    if (!(prior->sigma[i] >= 0.0)) entry.Fail("sigma", "must be zero (known) or above");
  }
  if (!source.effects) options->effects.clear();
  const RotorExtension extension = RotorExtensionOf(options->effects);
  prior->mean += extension.added;
  options->data.motor_lag += extension.motor_lag;
}

// The configuration's vehicle takes the place of the log's.
void WarnOfOtherVehicle(const std::string& config, const FlightLog& log,
                        RotorCalibrationOptions* options) {
  constexpr double kSame = 0.01;  // relative
  if (!log.vehicle) return;
  std::vector<std::string> other;
  const auto compare = [&](const std::string& what, double used, double logged) {
    if (std::abs(used - logged) <= kSame * std::abs(logged)) return;
    other.push_back(fmt::format("{} {:.4g} instead of {:.4g}", what, used, logged));
  };
  if (log.vehicle->mass)
    compare("mass [kg]", options->prior.mean[kMassConstant], *log.vehicle->mass);
  const std::vector<Rotor>& used = options->vehicle.model.rotors();
  const std::vector<Rotor>& logged = log.vehicle->rotors;
  for (std::size_t i = 0; i < std::min(used.size(), logged.size()); ++i) {
    compare(fmt::format("k_f of rotor {} [N/(rad/s)^2]", i + 1), used[i].k_f, logged[i].k_f);
  }
  if (other.empty()) return;
  options->warnings.push_back(
      fmt::format("the vehicle of {} is used, not that of log.yaml: {}; leave 'vehicle' out of the "
                  "configuration to use the log's",
                  config, fmt::join(other, ", ")));
}

}  // namespace

// Of four simulated flights the height of the centre of mass was 0.2 to 2.4 sigmas off at 125 Hz
// and 3.5 to 8 at 250 Hz.
constexpr double kHighestPoseRate = 60.0;

void Serialize(YamlArchive* a, RotorCalibrationOptions* o) {
  RotorDataOptions* data = &o->data;
  a->Choice("fit_to", &data->source, {{"mocap", PoseSource::kMocap}, {"pose", PoseSource::kPose}});
  a->Value("attitude", &data->attitude);
  a->Positive("pose_rate", &data->pose_rate);
  a->Require(data->pose_rate <= kHighestPoseRate, "pose_rate",
             fmt::format("is at most {} Hz: over shorter segments the accelerometer's noise looks "
                         "like a turn, and the centre of mass comes out wrong",
                         kHighestPoseRate));
  a->NotNegative("start", &data->start);
  a->NotNegative("end", &data->end);
  a->NotNegative("hold_out", &o->hold_out);
  a->Require(o->hold_out <= 0.8, "hold_out", "is a share of the flight, at most 0.8");
  a->Value("learn_noise", &o->learn_noise);
  a->Value("rotor_delay", &data->rotor_delay);
  a->Value("learn_rotor_delay", &o->learn_rotor_delay);
  a->Value("gyro_delay", &data->gyro_delay);
  a->Value("learn_gyro_delay", &o->learn_gyro_delay);
  a->Value("smooth_rotors", &data->smooth_rotors);
  a->NotNegative("robust_pose", &o->robust_pose);
  a->Value("widen", &o->widen);
  a->Map(
      "consider", [o](const YamlMap& map) { o->considered = ReadConsidered(map); },
      [o] { return ToYaml(o->considered); });
  a->NotNegative("wander", &o->wander);
  a->Nested("noise", &o->noise);
  a->Map(
      "prior", [o](const YamlMap& map) { ReadRotorPrior(map, &o->prior); },
      [o] { return ToYaml(o->prior); });
}

void ReadRotorOptions(const YamlMap& map, RotorCalibrationOptions* options) {
  YamlArchive archive(map);
  Serialize(&archive, options);
  ShareMotors(options);
}

namespace {

RotorCalibrationOptions OptionsWith(const RotorModelSource& model, const std::string& config,
                                    std::span<const FlightLog> logs) {
  const FlightLog& log = logs.front();
  if (config.empty()) {
    RotorCalibrationOptions options = OptionsFromLog(log);
    if (log.pose.empty()) options.data.source = PoseSource::kMocap;
    ApplyRotorModel(model, logs, &options);
    return options;
  }
  const YamlMap map = YamlMap::FromFile(config);
  RotorCalibrationOptions options =
      map.Has("vehicle")
          ? RotorCalibrationOptions(ReadRotorVehicle(map.Child("vehicle"), log.gravity))
          : OptionsFromLog(log);
  if (log.pose.empty()) options.data.source = PoseSource::kMocap;
  if (map.Has("motors")) ReadMotors(map.Child("motors"), &options);
  if (map.Has("vehicle")) WarnOfOtherVehicle(config, log, &options);
  ApplyRotorModel(model, logs, &options);
  ReadRotorOptions(map, &options);
  map.Finish();
  return options;
}

}  // namespace

RotorCalibrationOptions ResolveRotorOptions(const std::string& config, const std::string& model,
                                            std::span<const FlightLog> logs) {
  RotorCalibrationOptions options = OptionsWith({model}, config, logs);
  if (model.empty() || IsOwn(model, logs)) return options;
  const auto prior_with = [&](bool constants, bool effects) {
    return OptionsWith({model, constants, effects}, config, logs).prior;
  };
  options.of_effects = options.prior.mean - prior_with(true, false).mean;
  options.prior_without_model = WithoutModel(prior_with(false, true), options.prior);
  return options;
}

YAML::Node ToYaml(const RotorCalibrationOptions& given) {
  RotorCalibrationOptions options = given;
  YamlArchive archive;
  if (options.data.motors) {
    archive.Map("motors", [&](YamlArchive* map) {
      SerializeMotors(map, &*options.data.motors, &options.data.motors_at);
    });
  }
  std::string drive = "rotors";
  archive.Value("drive", &drive);
  Serialize(&archive, &options);
  YAML::Node node = archive.node();
  if (!options.effects.empty()) node["effects"] = EffectsNode(options.effects);
  for (const Rotor& rotor : options.vehicle.model.rotors()) {
    YAML::Node entry;
    for (const double value : rotor.position) entry["position"].push_back(value);
    for (const double value : rotor.axis) entry["axis"].push_back(value);
    entry["spin"] = rotor.spin;
    entry["k_f"] = rotor.k_f;
    entry["k_m"] = rotor.k_m;
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node["rotors"].push_back(entry);
  }
  return node;
}

}  // namespace trueline
