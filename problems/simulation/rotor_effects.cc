// Effects that a model driven by rotor speeds sees.
#include <algorithm>
#include <cmath>

#include "problems/simulation/effects.h"

namespace trueline::simulation {
namespace {

using Values = const EffectValues&;

std::vector<EffectDefinition> MakeRotorDrivenEffects() {
  return {
      // In addition to the vehicle's own drag.
      {"linear_drag",
       {{"K_x", "1/s"}, {"K_y", "1/s"}, {"K_z", "1/s"}},
       [](Values p, double, Stages* stages) {
         stages->drag.push_back(
             [added = p.Vector("K_x", "K_y", "K_z")](double, Vector3d* K) { *K += added; });
       }},
      {"thrust_sag",
       {{"d", "1/s"}},
       [](Values p, double, Stages* stages) {
         stages->rotor.push_back(
             [d = p["d"]](const Flow& flow, int, double* k) { *k *= 1.0 - d * flow.t; });
       }},
      {"rotor_loss",
       {{"rotor", "index"}, {"factor", "1"}},
       [](Values p, double, Stages* stages) {
         stages->rotor.push_back([lost = static_cast<int>(p["rotor"]), factor = p["factor"]](
                                     const Flow&, int rotor, double* k) {
           if (rotor == lost) *k *= factor;
         });
       }},
      {"rotor_inflow",
       {{"k", "1"}},
       [](Values p, double, Stages* stages) {
         stages->force.push_back([k = p["k"]](const Flow& flow, Vector3d* f_B) {
           f_B->z() -= k * flow.rotor_sum * flow.v_B.z();
         });
       }},
      {"rotor_speed_drag",
       {{"k", "1"}},
       [](Values p, double, Stages* stages) {
         stages->force.push_back([k = p["k"]](const Flow& flow, Vector3d* f_B) {
           f_B->head<2>() -= k * flow.rotor_sum * flow.v_B.head<2>();
         });
       }},
      {"motor_lag",
       {{"tau", "s"}},
       [](Values p, double, Stages* stages) {
         stages->motor_lag.push_back([tau = p["tau"]](double* lag) { *lag = tau; });
       }},
      {"translational_lift",
       {{"k", "1/m"}},
       [](Values p, double, Stages* stages) {
         stages->force.push_back([k = p["k"]](const Flow& flow, Vector3d* f_B) {
           f_B->z() -= k * flow.v_B.head<2>().squaredNorm();
         });
       }},
      {"body_drag",
       {{"c_x", "1/m"}, {"c_y", "1/m"}, {"c_z", "1/m"}},
       [](Values p, double, Stages* stages) {
         stages->force.push_back(
             [c = p.Vector("c_x", "c_y", "c_z")](const Flow& flow, Vector3d* f_B) {
               *f_B -= flow.v_B.norm() * c.cwiseProduct(flow.v_B);
             });
       }},
      // Air from ahead raises the nose, air from the right raises the right side.
      {"air_moment",
       {{"roll", "N s"}, {"pitch", "N s"}},
       [](Values p, double, Stages* stages) {
         stages->moment.push_back(
             [roll = p["roll"], pitch = p["pitch"]](const Flow& flow, Vector3d* moment_B) {
               *moment_B += Vector3d(-roll * flow.v_B.y(), pitch * flow.v_B.x(), 0.0);
             });
       }},
      // The ratio of k to a rotor's height is clamped to 0.9: the formula diverges at 1.
      {"ground_effect",
       {{"k", "m"}},
       [](Values p, double, Stages* stages) {
         stages->rotor.push_back([k = p["k"]](const Flow& flow, int, double* thrust) {
           const double ratio = std::min(0.9, k / std::max(flow.height, 1e-3));
           *thrust /= 1.0 - ratio * ratio;
         });
       }},
      {"payload_step",
       {{"t_step", "s"}, {"mass", "kg"}},
       [](Values p, double, Stages* stages) {
         stages->load.push_back([step = p["t_step"], mass = p["mass"]](double t, Load* load) {
           if (t >= step) load->mass += mass;
         });
       }},
      {"com_step",
       {{"t_step", "s"}, {"dx", "m"}, {"dy", "m"}},
       [](Values p, double, Stages* stages) {
         stages->load.push_back(
             [step = p["t_step"], x = p["dx"], y = p["dy"]](double t, Load* load) {
               if (t >= step) load->com += Vector3d(x, y, 0.0);
             });
       }},
      {"rotor_tilt",
       {{"roll", "rad"}, {"pitch", "rad"}},
       [](Values p, double, Stages* stages) {
         stages->thrust_axis.push_back([q = TurnedBy({p["roll"], p["pitch"], 0.0})](
                                           Quaterniond* axis) { *axis = q * *axis; });
       }},
  };
}

}  // namespace

const std::vector<EffectDefinition>& RotorDrivenEffects() {
  static const std::vector<EffectDefinition> effects = MakeRotorDrivenEffects();
  return effects;
}

}  // namespace trueline::simulation
