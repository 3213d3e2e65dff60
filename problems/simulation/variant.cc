#include <fmt/format.h>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/common/error.h"
#include "problems/common/random.h"
#include "problems/simulation/config.h"
#include "problems/simulation/forces.h"
#include "problems/simulation/simulate.h"

namespace trueline {
namespace {

// The address of each parameter in the configuration. Names as in eq. 16, or similar.
std::map<std::string, double*> Tunables(SimulationConfig* config) {
  std::map<std::string, double*> tunables{
      {"turbulence_memory", &config->turbulence.memory},
      {"heading_error", &config->ahrs.heading_error},
      {"tilt_gain", &config->ahrs.tilt_gain},
  };
  const auto add = [&](const std::vector<std::string>& names, Eigen::Vector3d* values) {
    for (int i = 0; i < 3; ++i) tunables[names[i]] = &(*values)[i];
  };
  add({"K_x", "K_y", "K_z"}, &config->vehicle.drag);
  add({"b_ax", "b_ay", "b_az"}, &config->imu.accel_bias);
  add({"b_gx", "b_gy", "b_gz"}, &config->imu.gyro_bias);
  add({"phi_I_B", "theta_I_B", "psi_I_B"}, &config->imu.misalignment);
  add({"phi_E_Ep", "theta_E_Ep", "psi_E_Ep"}, &config->ahrs.constant);
  for (Effect& effect : config->effects) {
    if (effect.term) continue;
    for (auto& [name, value] : effect.values) tunables[effect.id + "." + name] = &value;
  }
  return tunables;
}

// Why the value that was drawn for this parameter means nothing; empty if it does.
std::string WhyWrong(const SimulationConfig& config, const std::string& name) {
  const bool filter = config.ahrs.kind == simulation::AhrsKind::kComplementaryFilter;
  if (!filter && (name == "heading_error" || name == "tilt_gain")) {
    return "is of the complementary filter; `ahrs` is of another kind";
  }
  if (filter && name.ends_with("_E_Ep")) {
    return "is the outcome of the complementary filter; draw heading_error or tilt_gain";
  }
  if (name == "tilt_gain" && !(config.ahrs.tilt_gain > 0.0)) return "must be above zero";
  if (name == "turbulence_memory" && config.turbulence.memory < 0.0) return "must be zero or above";
  for (const Effect& effect : config.effects) {
    if (name.starts_with(effect.id + ".")) return WhyIdle(effect, ActorsOf(config));
  }
  return "";
}

}  // namespace

simulation::Actors ActorsOf(const SimulationConfig& config) {
  simulation::Actors flight;
  flight.fixes = flight.ahrs = true;
  flight.rotors = static_cast<int>(config.vehicle.rotors.size());
  if (config.gnss.rate > 0.0) return flight;
  for (const simulation::CoursePoint& point : config.course.points) {
    if (point.gate >= 0) flight.gates.push_back(point.gate);
  }
  return flight;
}

SimulationConfig DrawVariant(const SimulationConfig& config, std::uint64_t seed) {
  SimulationConfig variant = config;
  const std::map<std::string, double*> tunables = Tunables(&variant);
  for (const auto& [name, range] : config.randomise) {
    const auto found = tunables.find(name);
    if (found == tunables.end()) throw InputError("randomise: unknown parameter '" + name + "'");
    *found->second = Random(seed, "randomise." + name).Uniform(range.low, range.high);
    const std::string wrong = WhyWrong(variant, name);
    if (!wrong.empty()) throw InputError(fmt::format("randomise: {} {}", name, wrong));
  }
  return variant;
}

SimulationConfig WithModel(const SimulationConfig& config, const YamlMap& model) {
  SimulationConfig flown = config;
  const std::map<std::string, double*> tunables = Tunables(&flown);
  const YamlMap parameters = model.Child("parameters");
  for (int i = 0; i < kMotionSize; ++i) {
    const char* name = kTheta[i].name;
    if (IsVehicle(i)) *tunables.at(name) = parameters.Child(name).Get<double>("value");
  }
  for (const YamlMap& entry : model.Children("effects")) {
    if (entry.Get<std::string>("id") == "term") {
      flown.effects.push_back(simulation::ReadFlownTerm(entry));
      continue;
    }
    Effect effect{entry.Get<std::string>("id"), {}};
    for (const std::string& key : entry.Keys()) {
      if (key != "id") effect.values[key] = entry.Get<double>(key);
    }
    flown.effects.push_back(effect);
  }
  return flown;
}

std::map<std::string, double> TunableValues(const SimulationConfig& config) {
  SimulationConfig copy = config;
  std::map<std::string, double> values;
  for (const auto& [name, value] : Tunables(&copy)) values[name] = *value;
  return values;
}

}  // namespace trueline
