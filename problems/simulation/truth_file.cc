#include <algorithm>
#include <map>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/common/app.h"
#include "problems/effects/declaration.h"
#include "problems/result/yaml_text.h"
#include "problems/simulation/config.h"
#include "problems/simulation/forces.h"
#include "problems/simulation/simulate.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr int kDigits = 12;
constexpr int kAllDigits = 17;  // read back exactly

YAML::Node ParameterNode(double value, int digits, const std::string& unit) {
  return FlowMap({{"value", Rounded(value, digits)}, {"unit", unit}});
}

YAML::Node VectorNode(const Vector3d& value) {
  YAML::Node node(YAML::NodeType::Sequence);
  for (const double x : value) node.push_back(Rounded(x, kDigits));
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

bool Has(const SimulationTruth& truth, const std::vector<std::string>& ids) {
  for (const Effect& effect : truth.config.effects) {
    if (std::find(ids.begin(), ids.end(), effect.id) != ids.end()) return true;
  }
  return false;
}

// Eq. 16. A drifting AHRS error or bias is given by its mean over the flight.
YAML::Node ParametersNode(const SimulationTruth& truth) {
  const SimulationConfig& config = truth.config;
  const bool drag_constant = !Has(truth, {"drag_step"});
  const bool bias_constant = config.imu.accel_bias_walk == 0.0 && !Has(truth, {"accel_bias_drift"});
  const bool ahrs_constant = truth.ahrs_error_sigma.maxCoeff() < 1e-9;
  std::map<std::string, double> values = TunableValues(config);
  values["b_az"] += truth.accel_walk_mean.z();
  for (int i = 0; i < 3; ++i) values[kTheta[kAhrsInTheta + i].name] = truth.ahrs_error_mean[i];
  const std::map<ParameterGroup, bool> constant{{ParameterGroup::kDrag, drag_constant},
                                                {ParameterGroup::kBias, bias_constant},
                                                {ParameterGroup::kAhrsError, ahrs_constant},
                                                {ParameterGroup::kMisalignment, true}};
  YAML::Node parameters;
  for (int i = 0; i < kMotionSize; ++i) {
    const ParameterInfo& info = kTheta[i];
    parameters[info.name] = ParameterNode(values.at(info.name), kDigits, info.unit);
    parameters[info.name]["constant"] = constant.at(info.group);
  }
  parameters["K_z"] = ParameterNode(config.vehicle.drag.z(), kDigits, "1/s");
  parameters["K_z"]["constant"] = true;
  return parameters;
}

// IMU biases in I (SI).
YAML::Node ImuNode(const SimulationTruth& truth) {
  YAML::Node node;
  node["accel_bias"] = VectorNode(truth.config.imu.accel_bias + truth.accel_walk_mean);
  node["gyro_bias"] = VectorNode(truth.config.imu.gyro_bias);
  return node;
}

// Phi_E^E' of eq. 14 over the flight (rad).
YAML::Node AhrsErrorNode(const SimulationTruth& truth) {
  YAML::Node node;
  node["mean"] = VectorNode(truth.ahrs_error_mean);
  node["sigma"] = VectorNode(truth.ahrs_error_sigma);
  node["tilt_rms"] = Rounded(truth.tilt_error_rms, kDigits);
  node["tilt_max"] = Rounded(truth.tilt_error_max, kDigits);
  return node;
}

YAML::Node EffectNode(const Effect& effect) {
  YAML::Node entry = FlowMap({{"id", effect.id}});
  for (const auto& [name, value] : effect.values) entry[name] = Rounded(value, kDigits);
  return entry;
}

// [] where there is none.
YAML::Node ListNode(const std::vector<YAML::Node>& entries) {
  YAML::Node node(YAML::NodeType::Sequence);
  if (entries.empty()) node.SetStyle(YAML::EmitterStyle::Flow);
  for (const YAML::Node& entry : entries) node.push_back(entry);
  return node;
}

// What acts beyond the parameters: `effects` and `forces`, as a configuration of either kind of
// flight states them.
template <class Config>
void AddHidden(const Config& config, YAML::Node* node) {
  std::vector<YAML::Node> effects, forces;
  for (const simulation::UnnamedForce& force : config.forces) forces.push_back(ToYaml(force));
  for (const Effect& effect : config.effects) {
    if (effect.term) forces.push_back(ToYaml(effect));
    if (!effect.term) effects.push_back(EffectNode(effect));
  }
  (*node)["effects"] = ListNode(effects);
  (*node)["forces"] = ListNode(forces);
}

// s, m/s and m.
YAML::Node FlightNode(const SimulationTruth& truth) {
  YAML::Node node;
  node["duration"] = Rounded(truth.config.duration, kDigits);
  node["laps"] = Rounded(truth.laps, kDigits);
  node["passes"] = truth.passes;
  node["speed_mean"] = Rounded(truth.speed_mean, kDigits);
  node["path_error_rms"] = Rounded(truth.path_error_rms, kDigits);
  return node;
}

std::string Finish(std::uint64_t seed, const std::string& config_file, YAML::Node* node) {
  (*node)["seed"] = seed;
  (*node)["version"] = Version();
  (*node)["config"] = config_file;
  return TextOf(*node);
}

}  // namespace

std::string TruthYaml(const SimulationTruth& truth, const std::string& config_file) {
  YAML::Node node;
  node["parameters"] = ParametersNode(truth);
  node["imu"] = ImuNode(truth);
  node["ahrs_error"] = AhrsErrorNode(truth);
  AddHidden(truth.config, &node);
  node["flight"] = FlightNode(truth);
  return Finish(truth.seed, config_file, &node);
}

std::string TruthYaml(const RotorTruth& truth, const RotorSimulation& simulation,
                      std::uint64_t seed, const std::string& config_file) {
  YAML::Node node;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    const RotorConstantInfo& info = kRotorConstants[i];
    node["parameters"][info.name] = ParameterNode(truth.constants[i], kAllDigits, info.unit);
  }
  for (const double value : simulation.drag) node["drag"].push_back(Rounded(value, kAllDigits));
  node["motor_lag"] = Rounded(FlownLag(simulation), kAllDigits);
  AddHidden(simulation, &node);
  node["path_error_rms"] = Rounded(truth.path_error_rms, kAllDigits);
  return Finish(seed, config_file, &node);
}

std::filesystem::path TruthPath(const std::filesystem::path& log_directory) {
  std::string path = log_directory.lexically_normal().string();
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path + ".truth.yaml";
}

}  // namespace trueline
