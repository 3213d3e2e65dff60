#include "problems/simulation/truth_file.h"

#include <algorithm>
#include <map>
#include <optional>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/common/app.h"
#include "problems/simulation/variant.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

void Parameter(YAML::Emitter* out, const std::string& name, double value, const std::string& unit,
               const std::optional<bool>& constant = {}) {
  *out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap;
  *out << YAML::Key << "value" << YAML::Value << value;
  *out << YAML::Key << "unit" << YAML::Value << unit;
  if (constant) *out << YAML::Key << "constant" << YAML::Value << *constant;
  *out << YAML::EndMap;
}

void Vector(YAML::Emitter* out, const std::string& key, const Vector3d& value) {
  *out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  *out << value.x() << value.y() << value.z() << YAML::EndSeq;
}

bool Has(const SimulationTruth& truth, const std::vector<std::string>& ids) {
  for (const simulation::EffectSetting& effect : truth.config.effects) {
    if (std::find(ids.begin(), ids.end(), effect.id) != ids.end()) return true;
  }
  return false;
}

// Eq. 16. A drifting AHRS error or bias is given by its mean over the flight.
void Parameters(const SimulationTruth& truth, YAML::Emitter* out) {
  const SimulationConfig& config = truth.config;
  const bool drag_constant = !Has(truth, {"drag_step"});
  const bool bias_constant = config.imu.accel_bias_walk == 0.0 && !Has(truth, {"accel_bias_drift"});
  const bool ahrs_constant = truth.ahrs_error_sigma.maxCoeff() < 1e-9;
  *out << YAML::Key << "parameters" << YAML::Value << YAML::BeginMap;
  std::map<std::string, double> values = TunableValues(config);
  values["b_az"] += truth.accel_walk_mean.z();
  for (int i = 0; i < 3; ++i) values[kTheta[kAhrsInTheta + i].name] = truth.ahrs_error_mean[i];
  const std::map<ParameterGroup, bool> constant{{ParameterGroup::kDrag, drag_constant},
                                                {ParameterGroup::kBias, bias_constant},
                                                {ParameterGroup::kAhrsError, ahrs_constant},
                                                {ParameterGroup::kMisalignment, true}};
  for (int i = 0; i < kMotionSize; ++i) {
    const ParameterInfo& info = kTheta[i];
    Parameter(out, info.name, values.at(info.name), info.unit, constant.at(info.group));
  }
  Parameter(out, "K_z", config.vehicle.drag.z(), "1/s", true);
  *out << YAML::EndMap;
}

// IMU biases in I (SI); Phi_E^E' of eq. 14 over the flight (rad).
void Sensors(const SimulationTruth& truth, YAML::Emitter* out) {
  *out << YAML::Key << "imu" << YAML::Value << YAML::BeginMap;
  Vector(out, "accel_bias", truth.config.imu.accel_bias + truth.accel_walk_mean);
  Vector(out, "gyro_bias", truth.config.imu.gyro_bias);
  *out << YAML::EndMap;
  *out << YAML::Key << "ahrs_error" << YAML::Value << YAML::BeginMap;
  Vector(out, "mean", truth.ahrs_error_mean);
  Vector(out, "sigma", truth.ahrs_error_sigma);
  *out << YAML::Key << "tilt_rms" << YAML::Value << truth.tilt_error_rms;
  *out << YAML::Key << "tilt_max" << YAML::Value << truth.tilt_error_max << YAML::EndMap;
}

void Effects(const SimulationTruth& truth, YAML::Emitter* out) {
  *out << YAML::Key << "effects" << YAML::Value;
  if (truth.config.effects.empty()) *out << YAML::Flow;
  *out << YAML::BeginSeq;
  for (const simulation::EffectSetting& effect : truth.config.effects) {
    *out << YAML::Flow << YAML::BeginMap << YAML::Key << "id" << YAML::Value << effect.id;
    for (const auto& [name, value] : effect.values)
      *out << YAML::Key << name << YAML::Value << value;
    *out << YAML::EndMap;
  }
  *out << YAML::EndSeq;
}

void FlightSummary(const SimulationTruth& truth, YAML::Emitter* out) {
  *out << YAML::Key << "flight" << YAML::Value << YAML::BeginMap;
  *out << YAML::Key << "duration" << YAML::Value << truth.config.duration << YAML::Comment("s");
  *out << YAML::Key << "laps" << YAML::Value << truth.laps;
  *out << YAML::Key << "passes" << YAML::Value << truth.passes;
  *out << YAML::Key << "speed_mean" << YAML::Value << truth.speed_mean << YAML::Comment("m/s");
  *out << YAML::Key << "path_error_rms" << YAML::Value << truth.path_error_rms << YAML::Comment("m")
       << YAML::EndMap;
}

std::string Finish(std::uint64_t seed, const std::string& config_file, YAML::Emitter* out) {
  *out << YAML::Key << "seed" << YAML::Value << seed;
  *out << YAML::Key << "version" << YAML::Value << Version();
  *out << YAML::Key << "config" << YAML::Value << config_file << YAML::EndMap;
  return std::string(out->c_str()) + "\n";
}

}  // namespace

std::string TruthYaml(const SimulationTruth& truth, const std::string& config_file) {
  YAML::Emitter out;
  out.SetDoublePrecision(12);
  out << YAML::BeginMap;
  Parameters(truth, &out);
  Sensors(truth, &out);
  Effects(truth, &out);
  FlightSummary(truth, &out);
  return Finish(truth.seed, config_file, &out);
}

std::string TruthYaml(const RotorTruth& truth, const RotorSimulation& simulation,
                      std::uint64_t seed, const std::string& config_file) {
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::BeginMap << YAML::Key << "parameters" << YAML::Value << YAML::BeginMap;
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    const RotorConstantInfo& info = kRotorConstants[i];
    Parameter(&out, info.name, truth.constants[i], info.unit);
  }
  out << YAML::EndMap << YAML::Key << "drag" << YAML::Value << YAML::BeginSeq;
  for (const double value : simulation.drag) out << value;
  out << YAML::EndSeq << YAML::Key << "motor_lag" << YAML::Value << simulation.motor_lag;
  out << YAML::Key << "path_error_rms" << YAML::Value << truth.path_error_rms;
  return Finish(seed, config_file, &out);
}

std::filesystem::path TruthPath(const std::filesystem::path& log_directory) {
  std::string path = log_directory.lexically_normal().string();
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path + ".truth.yaml";
}

}  // namespace trueline
