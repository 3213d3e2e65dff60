// The declarations of the effects that the rotor-driven model sees (Boehm et al. 2020).
#include <cmath>

#include "problems/effects/declaration.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

constexpr char kFlyAndHover[] =
    "fly the same lines slowly and fast, with climbs, and hover between";
constexpr char kSpeedsOfRotors[] =
    "fly at one speed with much and little thrust (turns, dives), so that rotor speeds change "
    "while air speed does not";
constexpr char kRepeatAtTheEnd[] = "repeat the first manoeuvre at the end";
constexpr char kTurnEachAxis[] = "roll, pitch and yaw one after another, hard, and hover between";

}  // namespace

void RotorExtension::Add(const std::string& constant, double value) {
  added[FindRotorConstant(constant)] += value;
}

RotorExtension RotorExtensionOf(const std::vector<Effect>& effects) {
  RotorExtension extension;
  for (const Effect& effect : effects) InfoOf(effect).extend(effect, &extension);
  return extension;
}

RotorEffects RotorEffectsOn(const FlightLog& log, const std::vector<Effect>& effects) {
  RotorEffects on_log = RotorExtensionOf(effects).effects;
  BindTerms(log, &on_log.terms);
  return on_log;
}

std::vector<EffectInfo> RotorDrivenDeclarations() {
  using enum EntersAt;
  return {
      {
          .id = "linear_drag",
          .enters = kForce,
          .parameters = {{"K_x", "1/s", 0.1, 3.0, 0.02, true, 0.0, "K_x"},
                         {"K_y", "1/s", 0.1, 3.0, 0.02, true, 0.0, "K_y"},
                         {"K_z", "1/s", 0.1, 3.0, 0.02, true, 0.0, "K_z"}},
          .physics = "the air brakes body and rotors in proportion to speed",
          .definition = "f_B += diag(K) v_B",
          .separate_by = kSpeedsOfRotors,
          .drawn = {{"K_x", -1.2, -0.3}, {"K_y", -1.2, -0.3}, {"K_z", -0.8, -0.1}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                for (const char* name : {"K_x", "K_y", "K_z"}) all->Add(name, e[name]);
              },
      },
      {
          .id = "thrust_sag",
          .enters = kThrust,
          .parameters = {{"d", "1/s", 1e-3, 0.05, 5e-5}},
          .physics = "thrust at one rotor speed falls in flight: blades that wear or bend, air "
                     "that warms up",
          .definition = "k_f(t) = k_f (1 - d t)",
          .separate_by = kRepeatAtTheEnd,
          .drawn = {{"d", 0.0015, 0.015}},
          .extend = [](const Effect& e, RotorExtension* all) { all->effects.thrust_sag += e["d"]; },
      },
      {
          .id = "rotor_loss",
          .enters = kThrust,
          .parameters = {{"factor", "1", 0.05, 1.5, 0.003, false, 1.0}},
          .physics =
              "one rotor gives less thrust than the others at the same speed: a damaged or wrong "
              "propeller",
          .definition = "k_f of one rotor is multiplied by factor",
          .separate_by = kTurnEachAxis,
          .indices = {{"rotor", "index"}},
          .drawn = {{"rotor", 0.0, 3.0}, {"factor", 0.75, 0.95}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                auto& weak = all->effects.weak;
                weak.try_emplace(static_cast<int>(e["rotor"]), 1.0).first->second *= e["factor"];
              },
      },
      {
          .id = "rotor_inflow",
          .enters = kThrust,
          .parameters = {{"k", "1", 1e-5, 1e-3, 4e-6, true, 0.0, "inflow"}},
          .physics = "inflow from above unloads the rotors: thrust falls in a climb",
          .definition = "f_B,z += -k sum(omega_i) v_B,z",
          .separate_by = kSpeedsOfRotors,
          .drawn = {{"k", 0.0001, 0.0008}},
          .extend = [](const Effect& e, RotorExtension* all) { all->Add("inflow", e["k"]); },
      },
      {
          .id = "rotor_speed_drag",
          .enters = kForce,
          .parameters = {{"k", "1", 1e-5, 1e-3, 4e-6, false}},
          .physics = "blades flap and drag in the wind of flight, the more the faster they turn",
          .definition = "f_B,xy += -k sum(omega_i) v_B,xy",
          .separate_by = kSpeedsOfRotors,
          .drawn = {{"k", 8e-05, 0.0005}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                all->effects.AddForce(e["k"], []<class T>(double k, const RotorAirFlow<T>& air) {
                  const T drag(-k * air.speed_sum);
                  return Vec3<T>(drag * air.v_B[0], drag * air.v_B[1], T(0.0));
                });
              },
      },
      {
          .id = "motor_lag",
          .enters = kThrust,
          .parameters = {{"tau", "s", 0.01, 0.3, 0.002, false, 0.0, "motor_lag"}},
          .physics =
              "rotors.csv holds commands, or late readings, that the rotors follow with a lag",
          .definition = "the rotor speed follows its command as a first-order lag of tau",
          .separate_by = "change thrust and roll quickly and often",
          .drawn = {{"tau", 0.015, 0.08}},
          .extend = [](const Effect& e, RotorExtension* all) { all->motor_lag += e["tau"]; },
      },
      {
          .id = "translational_lift",
          .enters = kThrust,
          .parameters = {{"k", "1/m", 0.01, 1.0, 0.002, false}},
          .physics =
              "rotors that move sideways meet more air: thrust grows with horizontal air speed",
          .definition = "f_B,z += -k (v_B,x^2 + v_B,y^2)",
          .separate_by = kFlyAndHover,
          .drawn = {{"k", 0.15, 0.8}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                all->effects.AddForce(e["k"], []<class T>(double k, const RotorAirFlow<T>& air) {
                  const Vec3<T>& v = air.v_B;
                  return Vec3<T>(T(0.0), T(0.0), T(-k) * (v[0] * v[0] + v[1] * v[1]));
                });
              },
      },
      {
          .id = "body_drag",
          .enters = kForce,
          .parameters = {{"c_x", "1/m", 0.01, 1.0, 0.01, false},
                         {"c_y", "1/m", 0.01, 1.0, 0.01, false},
                         {"c_z", "1/m", 0.01, 1.0, 0.01, false}},
          .physics = "frame and body brake in proportion to the square of air speed",
          .definition = "f_B += -c norm(v_B) v_B by axis",
          .separate_by = kFlyAndHover,
          .drawn = {{"c_x", 0.2, 0.9}, {"c_y", 0.2, 0.9}, {"c_z", 0.2, 0.9}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                const double c[] = {e["c_x"], e["c_y"], e["c_z"]};
                for (int axis = 0; axis < 3; ++axis) {
                  all->effects.AddForce(c[axis], [axis]<class T>(double size,
                                                                 const RotorAirFlow<T>& air) {
                    constexpr double kStill = 1e-12;  // (m/s)^2: a slope exists at rest
                    using std::sqrt;
                    Vec3<T> drag(T(0.0), T(0.0), T(0.0));
                    drag[axis] = T(-size) * sqrt(air.v_B.squaredNorm() + T(kStill)) * air.v_B[axis];
                    return drag;
                  });
                }
              },
      },
      {
          .id = "air_moment",
          .enters = kForce,
          .parameters = {{"roll", "N s", 1e-5, 0.1, 1e-6, true, 0.0, "L_v"},
                         {"pitch", "N s", 1e-5, 0.1, 1e-6, true, 0.0, "M_u"}},
          .physics = "air speed gives a moment: drag acts above or below the centre of mass, and "
                     "blades that flap lift the side that meets the wind",
          .definition = "M_x += -roll v_B,y, M_y += pitch v_B,x about the centre of mass",
          .separate_by = kFlyAndHover,
          .drawn = {{"roll", 0.0007, 0.008, true}, {"pitch", 0.0007, 0.008, true}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                all->effects.AddMoment(e["roll"],
                                       []<class T>(double k, const RotorAirFlow<T>& air) {
                                         return Vec3<T>(T(-k) * air.v_B[1], T(0.0), T(0.0));
                                       });
                all->effects.AddMoment(e["pitch"],
                                       []<class T>(double k, const RotorAirFlow<T>& air) {
                                         return Vec3<T>(T(0.0), T(k) * air.v_B[0], T(0.0));
                                       });
              },
      },
      {
          .id = "ground_effect",
          .enters = kThrust,
          .parameters = {{"k", "m", 0.1, 0.6, 0.02, false}},
          .physics = "near the floor the rotors' downwash is blocked: thrust grows",
          .definition = "thrust is multiplied by 1 / (1 - (k / h)^2), h the height above the floor",
          .separate_by = "hover low and high",
          .enters_squared = true,
          .drawn = {{"k", 0.2, 0.45}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                all->effects.ground = std::hypot(all->effects.ground, e["k"]);
              },
      },
      {
          .id = "payload_step",
          .enters = kLoad,
          .parameters = {{"mass", "kg", 0.01, 3.0, 3e-4}},
          .physics = "mass is picked up or dropped in flight",
          .definition = "mass is added at t_step",
          .separate_by = kRepeatAtTheEnd,
          .indices = {{"t_step", "s"}},
          .drawn = {{"t_step", 4.0, 9.0}, {"mass", 0.01, 0.06, true}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                all->effects.load_steps.push_back({e["t_step"], e["mass"]});
              },
          .of_one_flight = true,
          .changes = {"m"},
      },
      {
          .id = "com_step",
          .enters = kLoad,
          .parameters = {{"dx", "m", 0.002, 0.1, 1e-4}, {"dy", "m", 0.002, 0.1, 1e-4}},
          .physics = "the centre of mass moves in flight: a battery or load that slips",
          .definition = "the centre of mass moves by dx, dy at t_step",
          .separate_by = kRepeatAtTheEnd,
          .indices = {{"t_step", "s"}},
          .drawn = {{"t_step", 4.0, 9.0}, {"dx", 0.002, 0.01, true}, {"dy", 0.002, 0.01, true}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                all->effects.load_steps.push_back({e["t_step"], 0.0, {e["dx"], e["dy"]}});
              },
          .of_one_flight = true,
          .changes = {"r_BM_x", "r_BM_y"},
      },
      {
          .id = "rotor_tilt",
          .enters = kThrust,
          .parameters = {{"roll", "rad", 0.01, 0.3, 0.002}, {"pitch", "rad", 0.01, 0.3, 0.002}},
          .physics =
              "the rotors' thrust is not along the body's z axis: bent arms, or a turned IMU",
          .definition = "the thrust axis is -z_B turned by roll and pitch",
          .separate_by = kTurnEachAxis,
          .drawn = {{"roll", 0.02, 0.1, true}, {"pitch", 0.02, 0.1, true}},
          .extend =
              [](const Effect& e, RotorExtension* all) {
                all->effects.tilt_roll += e["roll"];
                all->effects.tilt_pitch += e["pitch"];
              },
      },
  };
}

}  // namespace trueline
