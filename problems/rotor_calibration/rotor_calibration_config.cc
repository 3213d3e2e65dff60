#include "problems/rotor_calibration/rotor_calibration_config.h"

#include "problems/common/yaml_options.h"
#include "problems/effects/read_effects.h"
#include "problems/rotor_calibration/considered.h"

namespace trueline {
namespace {

const std::map<std::string, PoseSource> kSources = {{"pose", PoseSource::kPose},
                                                    {"mocap", PoseSource::kMocap}};

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

void ReadMotors(const YamlMap& map, RotorCalibrationOptions* options) {
  RotorDataOptions& data = options->data;
  MotorCurve curve;
  ReadPositive(map, "full_speed", &curve.full_speed);
  ReadPositive(map, "nominal_voltage", &curve.nominal_voltage);
  ReadPositive(map, "lag", &data.motors_at[kLag]);
  ReadNotNegative(map, "idle", &data.motors_at[kIdle]);
  if (data.motors_at[kIdle] >= 1.0) map.Fail("idle", "is a share of full_speed, below 1");
  ReadNotNegative(map, "voltage", &data.motors_at[kVoltage]);
  map.Finish();
  data.rotors = RotorSource::kMotors;
  data.motors = curve;
  options->prior.mean.segment<kMotorUnknowns>(FindRotorConstant("motor_lag")) = data.motors_at;
}

// The earlier flight's estimates and sigmas become the prior; biases keep theirs.
void ApplyRotorModel(const std::string& file, RotorCalibrationOptions* options) {
  RotorPrior* prior = &options->prior;
  const YamlMap model = YamlMap::FromFile(file);
  const YamlMap parameters = model.Child("parameters");
  for (const std::string& name : parameters.Keys()) {
    const int i = FindRotorConstant(name);
    if (i < 0) {
      parameters.Fail(name,
                      "is no constant of the rotor-driven model; --model needs the "
                      "model.yaml of a calibration with --drive=rotors");
    }
    if (name.starts_with("b_")) continue;
    const YamlMap entry = parameters.Child(name);
    prior->mean[i] = entry.Get<double>("value");
    prior->sigma[i] = entry.Get<double>("sigma");
  }
  options->effects = ReadEffects(model, DriveKind::kRotors);
  const RotorExtension extension = RotorExtensionOf(options->effects);
  prior->mean += extension.added;
  options->data.motor_lag += extension.motor_lag;
}

}  // namespace

void ReadRotorOptions(const YamlMap& map, RotorCalibrationOptions* options) {
  RotorDataOptions& data = options->data;
  ReadOption(map, "fit_to", kSources, &data.source);
  ReadOption(map, "attitude", &data.attitude);
  ReadPositive(map, "pose_rate", &data.pose_rate);
  ReadNotNegative(map, "start", &data.start);
  ReadNotNegative(map, "end", &data.end);
  ReadNotNegative(map, "hold_out", &options->hold_out);
  if (options->hold_out > 0.8) map.Fail("hold_out", "is a share of the flight, at most 0.8");
  ReadOption(map, "learn_noise", &options->learn_noise);
  ReadOption(map, "rotor_delay", &data.rotor_delay);
  ReadOption(map, "learn_rotor_delay", &options->learn_rotor_delay);
  ReadNotNegative(map, "robust_pose", &options->robust_pose);
  ReadOption(map, "widen", &options->widen);
  options->considered = ReadConsidered(map.ChildOrEmpty("consider"));
  ReadNotNegative(map, "wander", &options->wander);
  ReadRotorNoise(map.ChildOrEmpty("noise"), &options->noise);
  ReadRotorPrior(map.ChildOrEmpty("prior"), &options->prior);
  ShareMotors(options);
}

RotorCalibrationOptions ResolveRotorOptions(const std::string& config, const std::string& model,
                                            const FlightLog& log) {
  if (config.empty()) {
    RotorCalibrationOptions options = OptionsFromLog(log);
    if (log.pose.empty()) options.data.source = PoseSource::kMocap;
    if (!model.empty()) ApplyRotorModel(model, &options);
    return options;
  }
  const YamlMap map = YamlMap::FromFile(config);
  RotorCalibrationOptions options =
      map.Has("vehicle")
          ? RotorCalibrationOptions(ReadRotorVehicle(map.Child("vehicle"), log.gravity))
          : OptionsFromLog(log);
  if (log.pose.empty()) options.data.source = PoseSource::kMocap;
  if (map.Has("motors")) ReadMotors(map.Child("motors"), &options);
  if (!model.empty()) ApplyRotorModel(model, &options);
  ReadRotorOptions(map, &options);
  map.Finish();
  return options;
}

YAML::Node ToYaml(const RotorCalibrationOptions& options) {
  YAML::Node node;
  if (options.data.motors) {
    node["motors"]["full_speed"] = options.data.motors->full_speed;
    node["motors"]["nominal_voltage"] = options.data.motors->nominal_voltage;
    node["motors"]["lag"] = options.data.motors_at[kLag];
    node["motors"]["idle"] = options.data.motors_at[kIdle];
    node["motors"]["voltage"] = options.data.motors_at[kVoltage];
  }
  node["drive"] = "rotors";
  node["fit_to"] = NameOf(kSources, options.data.source);
  node["attitude"] = options.data.attitude;
  node["pose_rate"] = options.data.pose_rate;
  node["start"] = options.data.start;
  node["end"] = options.data.end;
  node["hold_out"] = options.hold_out;
  node["learn_noise"] = options.learn_noise;
  node["rotor_delay"] = options.data.rotor_delay;
  node["learn_rotor_delay"] = options.learn_rotor_delay;
  node["robust_pose"] = options.robust_pose;
  node["widen"] = options.widen;
  node["consider"] = ToYaml(options.considered);
  node["wander"] = options.wander;
  node["noise"] = ToYaml(options.noise);
  node["prior"] = ToYaml(options.prior);
  for (const Effect& effect : options.effects) {
    YAML::Node entry;
    entry["id"] = effect.id;
    for (const auto& [name, value] : effect.values) entry[name] = value;
    node["effects"].push_back(entry);
  }
  for (const RotorSpec& rotor : options.vehicle.model.rotors()) {
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
