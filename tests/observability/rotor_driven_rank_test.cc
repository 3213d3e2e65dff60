// Table I of Boehm et al. 2020 and its extensions, exactly.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "problems/observability/generic_rank.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

using Names = std::set<std::string>;

struct Answer {
  RotorDrivenSystem system;
  RankReport report;

  Names With(const std::string& status) const {
    Names names;
    for (const int state : report.states) {
      const std::string& name = system.errors()[state].name;
      if (report.StatusOf(state).rfind(status, 0) == 0) names.insert(name);
    }
    return names;
  }
  // The number of states that some sensor of the set depends on; the papers do not count the
  // others.
  int Seen() const { return static_cast<int>(report.states.size() - With("unobservable").size()); }
  double Direction(const std::string& state) const {
    const int index = FindState(system.errors(), state);
    for (const NullBlock& block : report.blocks) {
      for (std::size_t i = 0; i < block.states.size(); ++i) {
        if (block.states[i] == index) return block.directions(i, 0);
      }
    }
    return 0.0;
  }
};

Answer Ask(SensorSet sensors, Motion motion, const std::vector<std::string>& added = {},
           RotorDrivenModel model = TestQuadrotor()) {
  Answer answer{RotorDrivenSystem(std::move(model), sensors), {}};
  std::vector<int> states = answer.system.PaperStates();
  for (const auto& name : added) states.push_back(FindState(answer.system.errors(), name));
  answer.report = RotorDrivenRank(answer.system, TestNominal(), states, motion);
  return answer;
}

const SensorSet kImu = OnlySensors(true, false, false);
const SensorSet kPosition = OnlySensors(false, true, false);
const SensorSet kPose = OnlySensors(false, false, true);
const SensorSet kImuAndPosition = OnlySensors(true, true, false);
const SensorSet kImuAndPose = OnlySensors(true, false, true);
const Names kPoseOnlyUnseen = {"r_BI_x", "r_BI_y", "b_a_x", "b_a_y",
                               "b_a_z",  "b_w_x",  "b_w_y", "b_w_z"};

TEST(TableOne, ImuAloneLosesMassWithAccelerometerBiasAtConstantInputs) {
  const Answer a = Ask(kImu, Motion::kConstant);
  EXPECT_EQ(a.report.rank, 17);
  EXPECT_EQ(a.Seen(), 18);
  EXPECT_EQ(a.With("joint"), Names({"m", "b_a_z"}));
  EXPECT_EQ(a.With("unobservable"), Names({"theta_x", "theta_y", "theta_z", "p_x", "p_y", "p_z",
                                           "v_x", "v_y", "v_z", "r_BP_x", "r_BP_y", "r_BP_z"}));
  EXPECT_EQ(a.Direction("m"), 1.0);
  EXPECT_LT(a.Direction("b_a_z"), -10.0);  // d(F/m)/dm = -F/m^2, with F near -m g
}

TEST(TableOne, ImuAloneIsFullWithInputsThatVary) {
  const Answer a = Ask(kImu, Motion::kVarying);
  EXPECT_EQ(a.report.rank, 18);
  EXPECT_EQ(a.Seen(), 18);
  EXPECT_TRUE(a.With("joint").empty());
}

TEST(TableOne, PositionOrPoseAloneLoseTheHeightOfCentreWithSensor) {
  for (const SensorSet& sensors : {kPosition, kPose}) {
    for (const Motion motion : {Motion::kConstant, Motion::kVarying}) {
      const Answer a = Ask(sensors, motion);
      EXPECT_EQ(a.report.rank, 21);
      EXPECT_EQ(a.Seen(), 22);
      EXPECT_EQ(a.With("joint"), Names({"r_BM_z", "r_BP_z"}));
      EXPECT_EQ(a.With("unobservable"), kPoseOnlyUnseen);
      EXPECT_NEAR(a.Direction("r_BP_z"), a.Direction("r_BM_z"), 1e-6);
    }
  }
}

TEST(TableOne, ImuWithEitherIsFull) {
  for (const SensorSet& sensors : {kImuAndPosition, kImuAndPose}) {
    for (const Motion motion : {Motion::kConstant, Motion::kVarying}) {
      const Answer a = Ask(sensors, motion);
      EXPECT_EQ(a.report.rank, 30);
      EXPECT_TRUE(a.report.blocks.empty());
    }
  }
}

TEST(BeyondTableOne, FreeImuHeightIsLostWithTheOthers) {
  const Answer a = Ask(kImuAndPose, Motion::kVarying, {"r_BI_z"});
  EXPECT_EQ(a.report.rank, 30);
  EXPECT_EQ(a.With("joint"), Names({"r_BI_z", "r_BM_z", "r_BP_z"}));
  EXPECT_NEAR(a.Direction("r_BI_z"), 1.0, 1e-6);
  EXPECT_NEAR(a.Direction("r_BP_z"), 1.0, 1e-6);
}

TEST(BeyondTableOne, FreeRotorConstantsLoseOneCommonScale) {
  const Answer a = Ask(kImuAndPose, Motion::kVarying, {"k_f", "k_m"});
  EXPECT_EQ(a.report.rank, 31);
  EXPECT_EQ(a.With("joint"), Names({"m", "I_x", "I_y", "I_z", "k_f", "k_m"}));
  const std::vector<double> x = TestNominal();  // the null direction scales all of them
  EXPECT_NEAR(a.Direction("k_f"), 1.0 / x[RotorDrivenModel::kMass], 1e-3);
  EXPECT_NEAR(a.Direction("k_m"), 1.0 / x[RotorDrivenModel::kMass], 1e-3);
  EXPECT_NEAR(a.Direction("I_y"), 0.678e-3 / x[RotorDrivenModel::kMass], 1e-6);
}

TEST(BeyondTableOne, ConstantInputsLoseASecondCombinationWithFreeRotorConstants) {
  EXPECT_EQ(Ask(kImuAndPose, Motion::kConstant, {"k_f", "k_m"}).report.nullity(), 2);
}

TEST(BeyondTableOne, TiltedRotorsShowTheHeightOfTheCentre) {
  std::vector<Rotor> rotors = TestQuadrotor().rotors();
  const double lean[4][2] = {{3, 4}, {-3, 4}, {-3, -4}, {3, -4}};
  for (int i = 0; i < 4; ++i) {
    rotors[i].axis = Eigen::Vector3d(0.04 * lean[i][0], 0.04 * lean[i][1], 0.0);
    rotors[i].axis.z() = -std::sqrt(1.0 - rotors[i].axis.squaredNorm());
  }
  const RotorDrivenModel tilted(rotors);
  EXPECT_EQ(Ask(kPose, Motion::kVarying, {}, tilted).With("joint"), Names());
  EXPECT_EQ(Ask(kImuAndPose, Motion::kVarying, {"r_BI_z"}, tilted).report.rank, 31);
  EXPECT_EQ(Ask(kImuAndPose, Motion::kVarying, {"k_f", "k_m"}, tilted).report.nullity(), 1);
}

TEST(BeyondTableOne, HexarotorIsLikeAQuadrotor) {
  std::vector<Rotor> rotors;
  for (int i = 0; i < 6; ++i) {
    const double angle = M_PI / 3.0 * i;
    rotors.push_back({{0.15 * std::cos(angle), 0.15 * std::sin(angle), 0.0},
                      {0, 0, -1},
                      i % 2 == 0 ? 1 : -1,
                      3.8e-7,
                      3.6e-9});
  }
  const RotorDrivenModel hexarotor(rotors);
  EXPECT_EQ(Ask(kImuAndPose, Motion::kVarying, {}, hexarotor).report.rank, 30);
  EXPECT_EQ(Ask(kImu, Motion::kConstant, {}, hexarotor).report.rank, 17);
  EXPECT_EQ(Ask(kPose, Motion::kVarying, {}, hexarotor).With("joint"), Names({"r_BM_z", "r_BP_z"}));
  EXPECT_EQ(Ask(kImuAndPose, Motion::kHover, {}, hexarotor).report.rank, 21);
}

TEST(Motions, HoverShowsNeitherInertiaNorLeverArms) {
  const Answer a = Ask(kImuAndPose, Motion::kHover);
  EXPECT_EQ(a.report.rank, 21);
  EXPECT_EQ(a.With("unobservable"), Names({"I_x", "I_y", "I_z", "r_BI_x", "r_BI_y"}));
  EXPECT_EQ(a.With("joint"), Names({"p_x", "p_y", "p_z", "r_BP_x", "r_BP_y", "r_BP_z", "r_BM_z"}));
  EXPECT_EQ(a.With("ok").count("m"), 1u);
}

TEST(Motions, StraightFlightShowsOnlyTheInertiaThatItUses) {
  const Answer a = Ask(kImuAndPose, Motion::kStraight);
  EXPECT_EQ(a.report.rank, 26);
  EXPECT_EQ(a.With("unobservable"), Names({"I_x", "I_z", "r_BI_y"}));
  EXPECT_EQ(a.With("joint"), Names({"p_y", "r_BP_y"}));
}

TEST(Motions, VerticalFlightAddsNothingToHoverButBiasFromMassWithoutPose) {
  EXPECT_EQ(Ask(kImuAndPose, Motion::kVertical).report.rank, 21);
  EXPECT_EQ(Ask(kImu, Motion::kHover).report.rank, 8);
  EXPECT_EQ(Ask(kImu, Motion::kVertical).report.rank, 9);
}

TEST(Motions, TrimOfAVehicleThatCannotHoverIsRefused) {
  std::vector<Rotor> rotors = TestQuadrotor().rotors();
  rotors.pop_back();
  EXPECT_THROW(Ask(kImu, Motion::kHover, {}, RotorDrivenModel(rotors)), InputError);
}

}  // namespace
}  // namespace trueline
