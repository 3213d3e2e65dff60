#include "problems/simulation/variant.h"

#include "cost_functions/models/imu_driven_model.h"
#include "problems/common/error.h"
#include "problems/common/random.h"
#include "problems/simulation/flown_terms.h"

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
  for (simulation::EffectSetting& effect : config->effects) {
    for (auto& [name, value] : effect.values) tunables[effect.id + "." + name] = &value;
  }
  return tunables;
}

}  // namespace

SimulationConfig DrawVariant(const SimulationConfig& config, std::uint64_t seed) {
  SimulationConfig variant = config;
  const std::map<std::string, double*> tunables = Tunables(&variant);
  for (const auto& [name, range] : config.randomise) {
    const auto found = tunables.find(name);
    if (found == tunables.end()) throw InputError("randomise: unknown parameter '" + name + "'");
    *found->second = Random(seed, "randomise." + name).Uniform(range.low, range.high);
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
      flown.terms.push_back(simulation::ReadFlownTerm(entry));
      continue;
    }
    simulation::EffectSetting effect{entry.Get<std::string>("id"), {}};
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
