#include <gtest/gtest.h>

#include "problems/observability/generic_rank.h"

namespace trueline {
namespace {

std::string Status(const ImuDrivenSystem& system, const RankReport& report, const char* name) {
  return report.StatusOf(FindState(system.errors(), name));
}

TEST(ImuDrivenRank, AllNineAreShownByFlightThatTurnsAndTilts) {
  const ImuDrivenSystem system;
  EXPECT_EQ(ImuDrivenRank(system, system.AllStates(), Turning::kAny).rank, 15);
  EXPECT_EQ(ImuDrivenRank(system, system.AllStates(), Turning::kNoYaw).rank, 15);
}

// Rotation about the pitch axis only: a rotation of E' about it is equivalent to the opposite one
// of I.
TEST(ImuDrivenRank, PitchingAloneLosesOneTurn) {
  const ImuDrivenSystem system;
  const RankReport report = ImuDrivenRank(system, system.AllStates(), Turning::kPitch);
  EXPECT_EQ(report.rank, 14);
  EXPECT_EQ(Status(system, report, "theta_E_Ep"), "joint: J1");
  EXPECT_EQ(Status(system, report, "theta_I_B"), "joint: J1");
  EXPECT_EQ(Status(system, report, "K_x"), "ok");
}

// With a constant attitude only the product of the rotations is observable: three of six angles.
TEST(ImuDrivenRank, ConstantAttitudeLosesThreeAngles) {
  const ImuDrivenSystem system;
  const RankReport report = ImuDrivenRank(system, system.AllStates(), Turning::kNone);
  EXPECT_EQ(report.rank, 12);
  for (const char* name :
       {"phi_E_Ep", "theta_E_Ep", "psi_E_Ep", "phi_I_B", "theta_I_B", "psi_I_B"}) {
    EXPECT_EQ(Status(system, report, name), "joint: J1") << name;
  }
  EXPECT_EQ(Status(system, report, "b_az"), "ok");
}

TEST(ImuDrivenRank, KnownMountingLeavesNothingLost) {
  const ImuDrivenSystem system;
  std::vector<int> states = system.AllStates();
  states.resize(12);  // without Phi_I_B
  EXPECT_EQ(ImuDrivenRank(system, states, Turning::kNone).rank, 12);
}

}  // namespace
}  // namespace trueline
