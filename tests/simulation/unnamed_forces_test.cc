// Forces of the simulator that no effect states.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "problems/simulation/forces.h"
#include "tests/common/test_files.h"

namespace trueline::simulation {
namespace {

using testing::HasSubstr;

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

}  // namespace
}  // namespace trueline::simulation
