#include "problems/calibration/rotor_calibration_config.h"

#include "problems/calibration/conflict.h"
#include "problems/calibration/considered.h"
#include "problems/calibration/own_model.h"
#include "problems/common/yaml_archive.h"
#include "problems/effects/read_effects.h"

namespace trueline {
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

bool IsOwn(const std::string& model, std::span<const FlightLog> logs) {
  return std::ranges::any_of(logs, [&](const FlightLog& log) { return IsFittedTo(model, log); });
}

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
