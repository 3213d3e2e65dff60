// The declarations of forces on the vehicle, as the IMU-driven model sees them (Li et al. 2019, eq.
// 15).
#include "problems/effects/declaration.h"

namespace trueline {
namespace {

constexpr char kFasterAndSlower[] = "fly the same straights slowly and fast, and hover between";
constexpr char kBothWays[] = "fly each straight in both directions and hover at several headings";

}  // namespace

std::vector<EffectInfo> ForceDeclarations() {
  using enum EntersAt;
  return {
      {
          .id = "quadratic_drag",
          .enters = kForce,
          .parameters = {{"c", "1/m", 0.02, 1.0, 0.02, false}},
          .physics = "parasitic drag of frame and body grows with the square of air speed",
          .definition = "f_B,xy += -c norm(v_B) v_B,xy",
          .separate_by = kFasterAndSlower,
          .drawn = {{"c", 0.05, 0.5}},
          .add_force =
              [](const Effect& e, ForceEffects* all) {
                all->Add(e["c"], [](double c, const auto& air) { return air.Drag(air.speed * c); });
              },
      },
      {
          .id = "rotor_drag",
          .enters = kForce,
          .parameters = {{"k", "s/m", 0.005, 0.3, 0.004, false}},
          .physics = "induced drag of the rotors grows with thrust as well as with speed",
          .definition = "f_B,xy += -k T v_B,xy, T the specific thrust",
          .separate_by =
              "brake and turn hard at one speed, so that thrust changes while speed does not",
          .drawn = {{"k", 0.02, 0.15}},
          .add_force =
              [](const Effect& e, ForceEffects* all) {
                all->Add(e["k"],
                         [](double k, const auto& air) { return air.Drag(k * air.thrust); });
              },
      },
      {
          .id = "wind",
          .enters = kForce,
          .parameters = {{"w_x", "m/s", 0.1, 8.0, 0.03}, {"w_y", "m/s", 0.1, 8.0, 0.03}},
          .physics = "the air moves over ground, so that drag acts on another velocity than the "
                     "fixes show",
          .definition = "v_B = R_B_E (v_E - w_E)",
          .separate_by = kBothWays,
          .drawn = {{"w_x", 0.3, 2.5, true}, {"w_y", 0.3, 2.5, true}},
          .add_force =
              [](const Effect& e, ForceEffects* all) {
                all->wind_E += Eigen::Vector3d(e["w_x"], e["w_y"], 0.0);
              },
          .of_one_flight = true,
      },
      {
          .id = "drag_step",
          .enters = kForce,
          .parameters = {{"factor", "1", 0.05, 5.0, 0.03, true, 1.0}},
          .physics = "drag changes once in flight: a part lost, caught or damaged",
          .definition = "K_x and K_y are multiplied by factor from t_step on",
          .separate_by = "repeat the first lap at the end at the same speed",
          .indices = {{"t_step", "s"}},
          .drawn = {{"t_step", 30.0, 70.0}, {"factor", 1.3, 2.5}},
          .add_force =
              [](const Effect& e, ForceEffects* all) {
                all->drag_steps.push_back({e["t_step"], e["factor"]});
              },
          .of_one_flight = true,
          .changes = {"K_x", "K_y"},
      },
  };
}

}  // namespace trueline
