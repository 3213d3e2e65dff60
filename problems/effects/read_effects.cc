#include "problems/effects/read_effects.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace trueline {
namespace {

// The parameters that an effect must have: one left out or misspelled would silently be zero.
const std::vector<std::string>* ParametersOf(const std::string& id) {
  static const std::map<std::string, std::vector<std::string>> parameters = {
      {"quadratic_drag", {"c"}},
      {"rotor_drag", {"k"}},
      {"wind", {"w_x", "w_y"}},
      {"drag_step", {"t_step", "factor"}},
      {"accel_scale_z", {"s"}},
      {"accel_bias_drift", {"d"}},
      {"imu_lever_arm", {"r_x", "r_y", "r_z"}},
      {"ahrs_acceleration_error", {"k"}},
      {"heading_drift", {"d"}},
      {"heading_distortion", {"a_sin", "a_cos"}},
      {"attitude_latency", {"tau"}},
      {"fix_latency", {"tau"}},
      {"fix_scale", {"s"}},
      {"camera_misalignment", {"roll", "pitch", "yaw"}},
      {"gate_moved", {"gate", "dx", "dy", "dz"}},
      {"tilt_scale", {"s"}},
      {"linear_drag", {"K_x", "K_y", "K_z"}},
      {"thrust_sag", {"d"}},
      {"rotor_loss", {"rotor", "factor"}},
      {"rotor_inflow", {"k"}},
      {"rotor_speed_drag", {"k"}},
      {"motor_lag", {"tau"}},
      {"translational_lift", {"k"}},
      {"air_moment", {"roll", "pitch"}},
      {"ground_effect", {"k"}},
      {"payload_step", {"t_step", "mass"}},
      {"com_step", {"t_step", "dx", "dy"}},
      {"rotor_tilt", {"roll", "pitch"}}};
  const auto found = parameters.find(id);
  return found == parameters.end() ? nullptr : &found->second;
}

void CheckParameters(const YamlMap& entry, const Effect& effect) {
  const std::vector<std::string>* names = ParametersOf(effect.id);
  if (names == nullptr) return;
  const std::string all = fmt::format("{} takes {}", effect.id, fmt::join(*names, ", "));
  for (const auto& [key, value] : effect.values) {
    if (std::find(names->begin(), names->end(), key) == names->end()) {
      entry.Fail(key, "is no parameter of this effect; " + all);
    }
  }
  for (const std::string& name : *names) {
    if (effect.values.count(name) == 0) entry.Fail("id", fmt::format("'{}' lacks; {}", name, all));
  }
}

}  // namespace

std::vector<Effect> ReadEffects(const YamlMap& model, bool (*known)(const std::string& id)) {
  std::vector<Effect> effects;
  for (const YamlMap& entry : model.Children("effects")) {
    Effect effect{entry.Get<std::string>("id"), {}};
    if (!known(effect.id)) {
      entry.Fail("id", fmt::format("'{}' is no effect that an estimator can take; see the ids that "
                                   "trueline-diagnose lists",
                                   effect.id));
    }
    for (const std::string& key : entry.Keys()) {
      if (key == "id") continue;
      effect.values[key] = entry.Get<double>(key);
      if (!std::isfinite(effect.values[key])) entry.Fail(key, "must be a finite number");
    }
    CheckParameters(entry, effect);
    effects.push_back(effect);
  }
  return effects;
}

}  // namespace trueline
