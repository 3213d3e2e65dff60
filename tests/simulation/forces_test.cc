// Blade elements against what momentum theory and symmetry say in closed form.
#include "problems/simulation/forces.h"

#include <fstream>

#include "problems/common/error.h"
#include "problems/simulation/blade_elements.h"
#include "tests/common/test_files.h"

namespace trueline::simulation {
namespace {

constexpr double kSpeed = 1260.0;  // rad/s
constexpr double kF = 3.811e-7, kM = 3.62e-9;

Rotor SmallRotor(int spin) { return {Vector3d::Zero(), {0.0, 0.0, -1.0}, spin, kF, kM}; }

HubWrench In(const Vector3d& v_B, const Vector3d& w_B = Vector3d::Zero(), int spin = 1) {
  return BladeRotor({}, SmallRotor(spin)).WrenchOn({v_B, w_B, kSpeed});
}

TEST(BladeRotor, HasItsConstantsAtRestAtAnySpeed) {
  for (const int spin : {1, -1}) {
    const BladeRotor rotor({}, SmallRotor(spin));
    EXPECT_GT(rotor.profile_drag(), 0.01);
    EXPECT_LT(rotor.profile_drag(), 0.1);
    for (const double speed : {600.0, 1260.0, 1700.0}) {
      const HubWrench wrench = rotor.WrenchOn({Vector3d::Zero(), Vector3d::Zero(), speed});
      EXPECT_NEAR(wrench.force_B.z() / (-kF * speed * speed), 1.0, 1e-6);
      EXPECT_NEAR(wrench.moment_B.z() / (-spin * kM * speed * speed), 1.0, 1e-6);
      EXPECT_LT(wrench.force_B.head<2>().norm(), 1e-9);
    }
  }
}

TEST(BladeRotor, ThrustFallsInAClimbAndGrowsSideways) {
  const double rest = -In(Vector3d::Zero()).force_B.z();
  EXPECT_LT(-In({0.0, 0.0, -2.0}).force_B.z(), 0.95 * rest);
  EXPECT_GT(-In({0.0, 0.0, 1.0}).force_B.z(), 1.02 * rest);
  EXPECT_GT(-In({6.0, 0.0, 0.0}).force_B.z(), 1.05 * rest);
}

TEST(BladeRotor, DragsAgainstTheMotionAndFlapsBack) {
  const HubWrench forward = In({3.0, 0.0, 0.0});
  EXPECT_LT(forward.force_B.x(), 0.0);
  EXPECT_GT(forward.moment_B.y(), 0.0);  // raises the nose
  const HubWrench twice = In({6.0, 0.0, 0.0});
  EXPECT_NEAR(twice.force_B.x() / forward.force_B.x(), 2.0, 0.4);
}

// A rotor that turns the other way is the mirror image.
TEST(BladeRotor, MirrorsWithItsSpin) {
  const HubWrench one = In({2.0, 1.0, -0.5}, {0.3, -0.2, 0.0}, 1);
  const HubWrench other = In({2.0, -1.0, -0.5}, {-0.3, -0.2, 0.0}, -1);
  EXPECT_NEAR((one.force_B - Vector3d(1, -1, 1).cwiseProduct(other.force_B)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((one.moment_B - Vector3d(-1, 1, -1).cwiseProduct(other.moment_B)).norm(), 0.0, 1e-9);
}

TEST(BladeRotor, DampsTurnsAboutAnAxisInItsDisc) {
  const Vector3d left = In(Vector3d::Zero(), {3.0, 0.0, 0.0}, 1).moment_B +
                        In(Vector3d::Zero(), {3.0, 0.0, 0.0}, -1).moment_B;
  EXPECT_LT(left.x(), 0.0);
  EXPECT_NEAR(left.y(), 0.0, 1e-9);  // gyroscopic moments of both spins cancel
}

// Thrust of momentum theory in a climb: T = 2 rho A v (climb + v). The blades' own thrust is linear
// in the flow, so three speeds of climb state one line.
TEST(BladeRotor, ObeysMomentumTheoryInAClimb) {
  const double disc = 1.2 * M_PI * 0.0635 * 0.0635;
  std::vector<double> slopes;
  double last_through = 0.0, last_thrust = 0.0;
  for (const double climb : {0.0, 1.0, 2.0, 3.0}) {
    const double thrust = -In({0.0, 0.0, -climb}).force_B.z();
    const double through = 0.5 * climb + std::sqrt(0.25 * climb * climb + thrust / (2.0 * disc));
    if (climb > 0.0) slopes.push_back((thrust - last_thrust) / (through - last_through));
    last_through = through, last_thrust = thrust;
  }
  EXPECT_LT(slopes[0], 0.0);
  EXPECT_NEAR(slopes[1] / slopes[0], 1.0, 1e-6);
  EXPECT_NEAR(slopes[2] / slopes[0], 1.0, 1e-6);
}

TEST(BladeRotor, RefusesABladeThatCannotLiftSoMuch) {
  BladeConfig tiny;
  tiny.chord = 1e-4;
  EXPECT_THROW(BladeRotor(tiny, SmallRotor(1)), InputError);
}

// --- Forces of the simulator that no effect states.

std::vector<UnnamedForce> Read(const std::string& text) {
  const TestFolder folder;
  std::ofstream(folder / "forces.yaml") << text;
  std::vector<Effect> terms;
  return ReadUnnamedForces(YamlMap::FromFile(folder / "forces.yaml"), &terms);
}

TEST(UnnamedForces, GoWithAProductInTheVehiclesAxes) {
  const auto forces =
      Read("forces: [{along: y_B, goes_with: yaw rate * forward speed, size: 0.1}]\n");
  BodyState state;
  state.q_E_B =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ())).coeffs();
  state.v_E = {0.0, 4.0, 0.0};  // forward
  state.w_B = {0.0, 0.0, 2.0};
  EXPECT_LT((ForceOf(forces, state) - Vector3d(-0.8, 0.0, 0.0)).norm(), 1e-12);
}

TEST(UnnamedForces, FallOffAroundTheirPlace) {
  const auto forces = Read("forces: [{along: east, place: [8, 2], radius: 2, size: 1.5}]\n");
  BodyState state;
  state.p_E = {8.0, 2.0, -5.0};
  EXPECT_NEAR(ForceOf(forces, state).y(), 1.5, 1e-12);
  state.p_E.x() = 10.0;
  EXPECT_NEAR(ForceOf(forces, state).y(), 0.75, 1e-12);
  state.p_E.x() = 18.0;
  EXPECT_LT(ForceOf(forces, state).y(), 0.01);
}

TEST(UnnamedForces, RefuseWhatTheyDoNotKnow) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { Read(text); }); };
  EXPECT_THAT(error("forces: [{along: x_B, goes_with: pitch, size: 1}]\n"),
              HasSubstr("must be one of forward speed"));
  EXPECT_THAT(error("forces: [{along: x, goes_with: pitch rate, size: 1}]\n"), HasSubstr("x_B"));
  EXPECT_THAT(error("forces: [{along: x_B, size: 1}]\n"), HasSubstr("or a place"));
}

// --- Eddies have the size asked for, and change slowly.

TEST(SlowMoments, HaveTheirSizeAndChangeSlowly) {
  constexpr double kStep = 0.01;  // s
  constexpr int kSamples = 400000;
  SlowMoments moments(6.0, 3);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero(), changes = squares, before = moments.At(0.0);
  for (int k = 1; k <= kSamples; ++k) {
    const Eigen::Vector3d now = moments.At(k * kStep);
    squares += now.cwiseAbs2();
    changes += (now - before).cwiseAbs2();
    before = now;
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(squares[axis] / kSamples), 6.0, 0.3);
    EXPECT_LT(std::sqrt(changes[axis] / kSamples), 0.6);
  }
}

TEST(SlowMoments, AreAbsentUnlessAskedFor) {
  SlowMoments none(0.0, 3);
  for (double t = 0.0; t < 10.0; t += 0.1) EXPECT_EQ(none.At(t), Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace trueline::simulation
