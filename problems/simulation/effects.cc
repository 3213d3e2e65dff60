#include "problems/simulation/effects.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "problems/common/error.h"
#include "problems/simulation/forces.h"

namespace trueline::simulation {
namespace {

using Values = const EffectValues&;

// The AHRS mistakes kinematic acceleration for gravity: the z axis of E' follows -f through a
// first-order low-pass of gain k. With z' = (-a_x, -a_y, g) / g the angles of eq. 1 from E to E'
// are phi = a_y / g and theta = -a_x / g.
void AddAccelerationError(Values p, double gravity, Stages* stages) {
  stages->ahrs_error.push_back([k = p["k"], gravity, tilt = Eigen::Vector2d(0.0, 0.0)](
                                   const Motion& motion, Vector3d* angles) mutable {
    const Eigen::Vector2d apparent(motion.a_E.y() / gravity, -motion.a_E.x() / gravity);
    tilt += (1.0 - std::exp(-k * motion.dt)) * (apparent - tilt);
    angles->head<2>() += tilt;
  });
}

// An observer of position, velocity and tilt that knows no drag: what the deceleration k v makes of
// its velocity is fed back to its tilt. Poles of a Butterworth filter of third order.
void AddDragError(Values p, double gravity, Stages* stages) {
  constexpr double kPoles = 2.5;  // rad/s
  using Eigen::Vector2d;
  stages->ahrs_error.push_back(
      [k = p["k"], gravity, position = Vector2d(0.0, 0.0), velocity = Vector2d(0.0, 0.0),
       acceleration = Vector2d(0.0, 0.0)](const Motion& motion, Vector3d* angles) mutable {
        const Vector2d drag = k * motion.v_E.head<2>();
        acceleration -= motion.dt * std::pow(kPoles, 3) * position;
        velocity += motion.dt * (acceleration + drag - 2.0 * kPoles * kPoles * position);
        position += motion.dt * (velocity - 2.0 * kPoles * position);
        *angles += Vector3d(-acceleration.y(), acceleration.x(), 0.0) / gravity;
      });
}

// A gate's fix is map position - R_E_B * vector, so an object beside the gate displaces fixes in
// the opposite direction.
const std::vector<EffectDefinition>& Catalogue() {
  static const std::vector<EffectDefinition> effects = {
      // What an IMU-driven model sees.
      {"quadratic_drag",
       {{"c", "1/m"}},
       [](Values p, double, Stages* stages) {
         stages->force.push_back([c = p["c"]](const Flow& flow, Vector3d* f_B) {
           f_B->head<2>() -= c * flow.v_B.norm() * flow.v_B.head<2>();
         });
       }},
      {"rotor_drag",
       {{"k", "s/m"}},
       [](Values p, double, Stages* stages) {
         stages->force.push_back([k = p["k"]](const Flow& flow, Vector3d* f_B) {
           f_B->head<2>() -= k * flow.thrust * flow.v_B.head<2>();
         });
       }},
      {"wind",
       {{"w_x", "m/s"}, {"w_y", "m/s"}},
       [](Values p, double, Stages* stages) {
         stages->wind.push_back(
             [x = p["w_x"], y = p["w_y"]](double, Vector3d* w_E) { *w_E += Vector3d(x, y, 0.0); });
       }},
      {"drag_step",
       {{"t_step", "s"}, {"factor", "1"}},
       [](Values p, double, Stages* stages) {
         stages->drag.push_back([step = p["t_step"], factor = p["factor"]](double t, Vector3d* K) {
           if (t >= step) K->head<2>() *= factor;
         });
       }},
      {"accel_scale_z",
       {{"s", "1"}},
       [](Values p, double, Stages* stages) {
         stages->accel_scale.push_back([s = p["s"]](Vector3d* a) { a->z() *= 1.0 + s; });
       }},
      {"accel_bias_drift",
       {{"d", "m/s^3"}},
       [](Values p, double, Stages* stages) {
         stages->accel_bias.push_back([d = p["d"]](double t, Vector3d* b) { b->z() += d * t; });
       }},
      {"imu_lever_arm",
       {{"r_x", "m"}, {"r_y", "m"}, {"r_z", "m"}},
       [](Values p, double, Stages* stages) {
         stages->at_imu.push_back(
             [r = p.Vector("r_x", "r_y", "r_z")](const Motion& m, Vector3d* a) {
               *a += m.w_B.cross(m.w_B.cross(r)) + m.dw_B.cross(r);
             });
       }},
      {"ahrs_acceleration_error", {{"k", "1/s"}}, AddAccelerationError},
      {"ahrs_drag_error", {{"k", "1/s"}}, AddDragError},
      // The AHRS states R_E_B with its tilt, a turn by `lean` about a level axis, 1 + s times as
      // large.
      {"tilt_scale",
       {{"s", "1"}},
       [](Values p, double, Stages* stages) {
         stages->ahrs_error.push_back([s = p["s"]](const Motion& m, Vector3d* angles) {
           const Vector3d z_B_E = m.q_E_B * Vector3d::UnitZ();
           const double lean = std::acos(std::clamp(z_B_E.z(), -1.0, 1.0));
           if (lean < 1e-9) return;
           const Vector3d axis_E = Vector3d::UnitZ().cross(z_B_E).normalized();
           angles->head<2>() -= s * lean * axis_E.head<2>();
         });
       }},
      {"heading_drift",
       {{"d", "rad/s"}},
       [](Values p, double, Stages* stages) {
         stages->ahrs_error.push_back(
             [d = p["d"]](const Motion& m, Vector3d* angles) { angles->z() += d * m.t; });
       }},
      {"heading_distortion",
       {{"a_sin", "rad"}, {"a_cos", "rad"}},
       [](Values p, double, Stages* stages) {
         stages->ahrs_error.push_back(
             [a = p["a_sin"], b = p["a_cos"]](const Motion& m, Vector3d* angles) {
               const double psi = HeadingOf(m.q_E_B);
               angles->z() += a * std::sin(psi) + b * std::cos(psi);
             });
       }},
      {"attitude_latency",
       {{"tau", "s"}},
       [](Values p, double, Stages* stages) {
         stages->attitude_latency.push_back([tau = p["tau"]](double* total) { *total += tau; });
       }},
      {"fix_latency",
       {{"tau", "s"}},
       [](Values p, double, Stages* stages) {
         stages->fix_latency.push_back([tau = p["tau"]](double* total) { *total += tau; });
       }},
      {"fix_scale",
       {{"s", "1"}},
       [](Values p, double, Stages* stages) {
         stages->gate_vector.push_back([s = p["s"]](Vector3d* u_B) { *u_B *= 1.0 + s; });
       }},
      {"camera_misalignment",
       {{"roll", "rad"}, {"pitch", "rad"}, {"yaw", "rad"}},
       [](Values p, double, Stages* stages) {
         stages->gate_vector.push_back(
             [q = TurnedBy(p.Vector("roll", "pitch", "yaw"))](Vector3d* u_B) { *u_B = q * *u_B; });
       }},
      {"gate_moved",
       {{"gate", "id"}, {"dx", "m"}, {"dy", "m"}, {"dz", "m"}},
       [](Values p, double, Stages* stages) {
         stages->gate.push_back([moved = static_cast<int>(p["gate"]),
                                 d = p.Vector("dx", "dy", "dz")](int id, Vector3d* position) {
           if (id == moved) *position += d;
         });
       }},
      // A share of the detections is of another object, displaced from the gate by d (gate -1: any
      // gate).
      {"false_gate",
       {{"fraction", "1"},
        {"gate", "id", -1.0},
        {"dx", "m", 0.0},
        {"dy", "m", 1.5},
        {"dz", "m", 0.0}},
       [](Values p, double, Stages* stages) {
         stages->false_gate.push_back(
             [fraction = p["fraction"], only = static_cast<int>(p["gate"]),
              d = p.Vector("dx", "dy", "dz")](int id, Random* random, Vector3d* seen) {
               const bool taken = random->Bernoulli(fraction);
               if (taken && (only < 0 || only == id)) *seen += d;
             });
       }},
      // What a model driven by rotor speeds sees.
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
  return effects;
}

std::string UnknownText(const std::string& id) {
  std::vector<std::string> ids;
  for (const EffectDefinition& effect : Catalogue()) ids.push_back(effect.id);
  return fmt::format("unknown effect '{}'; use one of: {}", id, fmt::join(ids, ", "));
}

// The values of a setting, checked against the definition, with defaults for missing ones.
std::map<std::string, double> Complete(const Effect& effect, const EffectDefinition& definition) {
  std::map<std::string, double> values;
  std::vector<std::string> known;
  for (const EffectParameter& parameter : definition.parameters) {
    known.push_back(fmt::format("{} [{}]", parameter.name, parameter.unit));
    const auto given = effect.values.find(parameter.name);
    if (given == effect.values.end() && !parameter.fallback) {
      throw InputError(fmt::format("effect {}: parameter '{}' [{}] is missing; add it", effect.id,
                                   parameter.name, parameter.unit));
    }
    values[parameter.name] = given == effect.values.end() ? *parameter.fallback : given->second;
  }
  for (const auto& [name, value] : effect.values) {
    if (values.count(name) > 0) continue;
    throw InputError(fmt::format("effect {}: unknown parameter '{}'; it has: {}", effect.id, name,
                                 fmt::join(known, ", ")));
  }
  return values;
}

}  // namespace

const EffectDefinition* FindEffect(const std::string& id) {
  const auto found = std::ranges::find(Catalogue(), id, &EffectDefinition::id);
  return found == Catalogue().end() ? nullptr : &*found;
}

Effect ReadEffect(const YamlMap& map) {
  Effect effect;
  effect.id = map.Get<std::string>("id");
  const EffectDefinition* definition = FindEffect(effect.id);
  if (definition == nullptr) map.Fail("id", UnknownText(effect.id));
  for (const EffectParameter& parameter : definition->parameters) {
    effect.values[parameter.name] = parameter.fallback
                                        ? map.Get<double>(parameter.name, *parameter.fallback)
                                        : map.Get<double>(parameter.name);
  }
  map.Finish();
  return effect;
}

namespace {

// Of a parameter that counts gates or rotors.
std::string WrongIndex(const std::string& name, double value, const std::vector<int>& known) {
  const auto is = [value](int id) { return id == value; };
  if (std::any_of(known.begin(), known.end(), is)) return "";
  return fmt::format("{} {} is none of this flight; use one of: {}", name, value,
                     fmt::join(known, ", "));
}

std::string WrongValue(const Effect& effect, const Actors& flight) {
  const EffectValues p(effect.values);
  if (effect.id == "rotor_loss") {
    std::vector<int> rotors(flight.rotors);
    std::iota(rotors.begin(), rotors.end(), 0);
    return WrongIndex("rotor", p["rotor"], rotors);
  }
  if (effect.id == "gate_moved") return WrongIndex("gate", p["gate"], flight.gates);
  if (effect.id != "false_gate") return "";
  if (!(p["fraction"] >= 0.0 && p["fraction"] <= 1.0)) {
    return fmt::format("fraction {} is no share: 0 to 1", p["fraction"]);
  }
  std::vector<int> gates = flight.gates;
  gates.push_back(-1);  // any gate
  return WrongIndex("gate", p["gate"], gates);
}

}  // namespace

std::string WhyIdle(const Effect& effect, const Actors& flight) {
  const Stages stages = StagesWith({effect}, 9.81);
  const bool of_gates =
      !stages.gate.empty() || !stages.false_gate.empty() || !stages.gate_vector.empty();
  if (of_gates && flight.gates.empty()) return "acts on what a camera sees of gates; here is none";
  if (!stages.fix_latency.empty() && !flight.fixes) return "acts on fixes; here are none";
  const bool of_ahrs = !stages.ahrs_error.empty() || !stages.attitude_latency.empty();
  if (of_ahrs && !flight.ahrs) return "acts on the attitude of an AHRS; here is none";
  if (effect.id == "ground_effect" && !flight.above_floor) {
    return "needs a height above the floor; set simulation: {height: ...}";
  }
  return WrongValue(effect, flight);
}

void ReadActingEffects(const YamlMap& map, const Actors& flight, std::vector<Effect>* effects) {
  for (const YamlMap& entry : map.Children("effects")) {
    effects->push_back(ReadEffect(entry));
    const std::string idle = WhyIdle(effects->back(), flight);
    if (!idle.empty()) entry.Fail("id", effects->back().id + ": " + idle);
  }
}

Stages StagesWith(const std::vector<Effect>& effects, double gravity) {
  Stages stages;
  for (const Effect& effect : effects) {
    if (effect.term) {
      AddTerm(effect, &stages);
      continue;
    }
    const EffectDefinition* definition = FindEffect(effect.id);
    if (definition == nullptr) throw InputError(UnknownText(effect.id));
    const std::map<std::string, double> values = Complete(effect, *definition);
    definition->add(EffectValues(values), gravity, &stages);
  }
  return stages;
}

}  // namespace trueline::simulation
