#include "problems/effects/rotor_extension.h"

#include <functional>
#include <map>

namespace trueline {
namespace {

using Apply = std::function<void(const Effect&, RotorExtension*)>;

void Add(const std::string& constant, double value, RotorExtension* all) {
  all->added[FindRotorConstant(constant)] += value;
}

const std::map<std::string, Apply>& Appliers() {
  using E = const Effect&;
  using X = RotorExtension*;
  static const std::map<std::string, Apply> appliers = {
      {"linear_drag",
       [](E e, X x) { Add("K_x", e["K_x"], x), Add("K_y", e["K_y"], x), Add("K_z", e["K_z"], x); }},
      {"rotor_inflow", [](E e, X x) { Add("inflow", e["k"], x); }},
      {"thrust_sag", [](E e, X x) { x->effects.thrust_sag = e["d"]; }},
      {"rotor_loss",
       [](E e, X x) {
         x->effects.weak_rotor = static_cast<int>(e["rotor"]);
         x->effects.weak_factor = e["factor"];
       }},
      {"rotor_speed_drag", [](E e, X x) { x->effects.speed_drag = e["k"]; }},
      {"motor_lag", [](E e, X x) { x->motor_lag = e["tau"]; }},
      {"translational_lift", [](E e, X x) { x->effects.lift = e["k"]; }},
      {"air_moment",
       [](E e, X x) {
         x->effects.moment_roll = e["roll"];
         x->effects.moment_pitch = e["pitch"];
       }},
      {"ground_effect", [](E e, X x) { x->effects.ground = e["k"]; }},
      {"payload_step",
       [](E e, X x) {
         x->effects.payload = e["mass"];
         x->effects.payload_time = e["t_step"];
       }},
      {"com_step",
       [](E e, X x) {
         x->effects.com = {e["dx"], e["dy"]};
         x->effects.com_time = e["t_step"];
       }},
      {"rotor_tilt",
       [](E e, X x) {
         x->effects.tilt_roll = e["roll"];
         x->effects.tilt_pitch = e["pitch"];
       }},
  };
  return appliers;
}

}  // namespace

RotorExtension RotorExtensionOf(const std::vector<Effect>& effects) {
  RotorExtension extension;
  for (const Effect& effect : effects) Appliers().at(effect.id)(effect, &extension);
  return extension;
}

bool IsRotorEffect(const std::string& effect_id) { return Appliers().count(effect_id) > 0; }

}  // namespace trueline
