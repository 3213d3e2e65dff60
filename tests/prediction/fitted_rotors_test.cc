// The rotor drive's model by numbers: axes, and sizes of effects.
#include "cost_functions/models/fitted_rotors.h"

#include <gtest/gtest.h>

#include "problems/effects/declaration.h"

namespace trueline {
namespace {

constexpr double kArm = 0.035, kLift = 3.7e-8, kSpeed = 1700.0;

std::vector<Rotor> Rotors() {
  std::vector<Rotor> rotors;
  for (const auto& [x, y, spin] : {std::tuple{1, 1, -1}, {-1, 1, 1}, {-1, -1, -1}, {1, -1, 1}}) {
    rotors.push_back({{x * kArm, y * kArm, 0.0}, {0.0, 0.0, -1.0}, spin, kLift, 1.4e-10});
  }
  return rotors;
}

std::vector<double> Numbers(int effects) {
  std::vector<double> c(RotorAeroModel::kConstants + effects, 0.0);
  for (const auto& [name, value] : {std::pair{"m", 0.045},
                                    {"I_x", 2.7e-5},
                                    {"I_y", 3e-5},
                                    {"I_z", 3.2e-5},
                                    {"k_f", 1.0},
                                    {"k_m", 1.0},
                                    {"K_x", -0.4},
                                    {"M_u", 20.0},
                                    {"L_p", -3.0},
                                    {"J_r", 2.7e-8}}) {
    c[FindRotorConstant(name)] = value;
  }
  return c;
}

RotorInput Hover() { return {0.0, std::vector<double>(4, kSpeed)}; }

// Up, forward and left are positive; a push on the left rolls right.
TEST(FittedRotors, ForwardLeftUp) {
  const FittedRotors model(Rotors(), 9.81, {});
  const std::vector<double> c = Numbers(0);
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const auto hover = model.At<double>(c.data(), none, none, Hover());
  EXPECT_NEAR(hover.force.z(), 4.0 * kLift * kSpeed * kSpeed / 0.045, 1e-9);
  EXPECT_NEAR(hover.force.head<2>().norm() + hover.turn.norm(), 0.0, 1e-12);
  const auto forward = model.At<double>(c.data(), {2.0, 0.0, 0.0}, none, Hover());
  EXPECT_NEAR(forward.force.x(), -0.8, 1e-12);
  EXPECT_NEAR(forward.turn.y(), -40.0, 1e-9);  // nose up
  EXPECT_NEAR(model.LinearDrag(c.data(), Hover()), 0.4, 1e-12);
  EXPECT_NEAR(model.At<double>(c.data(), none, {1.0, 0.0, 0.0}, Hover()).turn.x(), -3.0, 1e-9);
  RotorInput left = Hover();
  left.speeds[2] = left.speeds[3] = kSpeed + 50.0;
  EXPECT_GT(model.At<double>(c.data(), none, none, left).turn.x(), 0.0);
}

// A size that a fit moves acts as the same effect in the model; its slope is that of a unit.
TEST(FittedRotors, SizesAreThoseOfTheEffects) {
  const std::vector<Effect> effects = {
      {"rotor_speed_drag", {{"k", 8e-5}}},
      {"translational_lift", {{"k", 0.2}}},
      {"term", {{"size", 0.1}}, std::make_shared<TermForm>(ParseTerm("force_z", "v_y*v_y"))}};
  std::vector<RotorEffects> units;
  std::vector<double> c = Numbers(3);
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const auto& [name, size] = *effects[i].values.begin();
    units.push_back(RotorExtensionOf({{effects[i].id, {{name, 1.0}}, effects[i].term}}).effects);
    c[c.size() - 3 + i] = size;
  }
  const FittedRotors fitted(Rotors(), 9.81, units);
  const RotorAeroModel model(Rotors(), 9.81, RotorExtensionOf(effects).effects);
  std::vector<double> x(RotorAeroModel::kStates, 0.0);
  x[0] = 1.0;
  x[RotorDrivenModel::kVelocity] = 2.0;
  x[RotorDrivenModel::kVelocity + 1] = -1.0;
  x[RotorDrivenModel::kVelocity + 2] = 0.5;
  std::copy_n(c.begin(), RotorAeroModel::kConstants, x.begin() + RotorAeroModel::kMoving);
  const auto expected = model.BodyAccelerationOf(x.data(), Hover());
  const auto found =
      fitted.At<double>(c.data(), {2.0, 1.0, -0.5}, Eigen::Vector3d::Zero(), Hover());
  const Eigen::Vector3d turned(found.force.x(), -found.force.y(), -found.force.z());
  EXPECT_LT((turned - expected.force).norm(), 1e-9);
  EXPECT_NEAR(fitted.LinearDrag(c.data(), Hover()), 0.4 + 8e-5 * 4.0 * kSpeed, 1e-6);
}

}  // namespace
}  // namespace trueline
