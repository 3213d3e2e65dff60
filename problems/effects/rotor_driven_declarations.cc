// The declarations of the effects that the rotor-driven model sees (Boehm et al. 2020).
#include "problems/effects/declaration.h"

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

std::vector<EffectInfo> RotorDrivenDeclarations() {
  using enum EntersAt;
  return {
      {"linear_drag",
       kForce,
       {{"K_x", "1/s", 0.1, 3.0, 0.02},
        {"K_y", "1/s", 0.1, 3.0, 0.02},
        {"K_z", "1/s", 0.1, 3.0, 0.02}},
       "the air brakes body and rotors in proportion to speed",
       "f_B += diag(K) v_B",
       kSpeedsOfRotors},
      {"thrust_sag",
       kThrust,
       {{"d", "1/s", 1e-3, 0.05, 5e-5}},
       "thrust at one rotor speed falls in flight: blades that wear or bend, air that warms up",
       "k_f(t) = k_f (1 - d t)",
       kRepeatAtTheEnd},
      {"rotor_loss",
       kThrust,
       {{"factor", "1", 0.05, 1.5, 0.003, false, 1.0}},
       "one rotor gives less thrust than the others at the same speed: a damaged or wrong "
       "propeller",
       "k_f of one rotor is multiplied by factor",
       kTurnEachAxis,
       {{"rotor", "index"}}},
      {"rotor_inflow",
       kThrust,
       {{"k", "1", 1e-5, 1e-3, 4e-6}},
       "inflow from above unloads the rotors: thrust falls in a climb",
       "f_B,z += -k sum(omega_i) v_B,z",
       kSpeedsOfRotors},
      {"rotor_speed_drag",
       kForce,
       {{"k", "1", 1e-5, 1e-3, 4e-6, false}},
       "blades flap and drag in the wind of flight, the more the faster they turn",
       "f_B,xy += -k sum(omega_i) v_B,xy",
       kSpeedsOfRotors},
      {"motor_lag",
       kThrust,
       {{"tau", "s", 0.01, 0.3, 0.002, false}},
       "rotors.csv holds commands, or late readings, that the rotors follow with a lag",
       "the rotor speed follows its command as a first-order lag of tau",
       "change thrust and roll quickly and often"},
      {"translational_lift",
       kThrust,
       {{"k", "1/m", 0.01, 1.0, 0.002, false}},
       "rotors that move sideways meet more air: thrust grows with horizontal air speed",
       "f_B,z += -k (v_B,x^2 + v_B,y^2)",
       kFlyAndHover},
      {"air_moment",
       kForce,
       {{"roll", "N s", 1e-5, 0.1, 1e-6}, {"pitch", "N s", 1e-5, 0.1, 1e-6}},
       "air speed gives a moment: drag acts above or below the centre of mass, and "
       "blades that flap lift the side that meets the wind",
       "M_x += -roll v_B,y, M_y += pitch v_B,x about the centre of mass",
       kFlyAndHover},
      {"ground_effect",
       kThrust,
       {{"k", "m", 0.1, 0.6, 0.02, false}},
       "near the floor the rotors' downwash is blocked: thrust grows",
       "thrust is multiplied by 1 / (1 - (k / h)^2), h the height above the floor",
       "hover low and high",
       {},
       Role::kCause,
       true},
      {"payload_step",
       kLoad,
       {{"mass", "kg", 0.01, 3.0, 3e-4}},
       "mass is picked up or dropped in flight",
       "mass is added at t_step",
       kRepeatAtTheEnd,
       {{"t_step", "s"}}},
      {"com_step",
       kLoad,
       {{"dx", "m", 0.002, 0.1, 1e-4}, {"dy", "m", 0.002, 0.1, 1e-4}},
       "the centre of mass moves in flight: a battery or load that slips",
       "the centre of mass moves by dx, dy at t_step",
       kRepeatAtTheEnd,
       {{"t_step", "s"}}},
      {"rotor_tilt",
       kThrust,
       {{"roll", "rad", 0.01, 0.3, 0.002}, {"pitch", "rad", 0.01, 0.3, 0.002}},
       "the rotors' thrust is not along the body's z axis: bent arms, or a turned IMU",
       "the thrust axis is -z_B turned by roll and pitch",
       kTurnEachAxis},
  };
}

}  // namespace trueline
