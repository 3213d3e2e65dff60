// Ranks of small systems whose Lie derivatives are known by hand.
#include "problems/observability/rank.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "problems/observability/lie_derivatives.h"
#include "problems/observability/observe.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

using Names = std::set<std::string>;

// A point mass on a line with drag k and scale s of its position sensor: x' = v, v' = -k v, y = s
// x. Scale, x and v are observable only jointly: (x, v, k, s) -> (x/c, v/c, k, c s).
struct DragSystem {
  static constexpr int kStates = 4, kMoving = 2, kErrors = 4;
  int num_outputs() const { return 1; }
  template <class T>
  void Derivative(const T* x, const T*, T* dx) const {
    dx[0] = x[1];
    dx[1] = -x[2] * x[1];
  }
  template <class T>
  void Output(const T* x, const T*, T* y) const {
    y[0] = x[3] * x[0];
  }
  template <class C>
  void Seed(const C* x, ceres::Jet<C, 4>* out) const {
    for (int i = 0; i < 4; ++i) out[i] = ceres::Jet<C, 4>(x[i], i);
  }
};

TEST(LieDerivatives, AgreeWithThoseByHand) {
  const double x = 0.3, v = 1.2, k = 0.7, s = 2.0;
  const Eigen::MatrixXd o = ObservabilityMatrix<3, double>(DragSystem{}, {x, v, k, s}, {}, 3);
  Eigen::MatrixXd want(4, 4);  // of L0 = s x, L1 = s v, L2 = -s k v, L3 = s k^2 v, over i!
  want << s, 0, 0, x,          //
      0, s, 0, v,              //
      0, -s * k / 2, -s * v / 2, -k * v / 2,  //
      0, s * k * k / 6, s * k * v / 3, k * k * v / 6;
  EXPECT_LT((o - want).norm(), 1e-14);
}

TEST(ExactRank, FindsTheScaleThatIsLost) {
  const std::vector<Modular> x = {Modular(0.3), Modular(1.2), Modular(0.7), Modular(2.0)};
  const auto o = ObservabilityMatrix<4, Modular>(DragSystem{}, x, {}, 4);
  RankReport report = ExactRank(o, {0, 1, 2, 3});
  EXPECT_EQ(report.rank, 3);
  ASSERT_EQ(report.blocks.size(), 1u);
  EXPECT_EQ(report.blocks[0].states, (std::vector<int>{0, 1, 3}));
  EXPECT_EQ(report.StatusOf(0), "joint: J1");
  EXPECT_EQ(report.StatusOf(2), "ok");

  const Eigen::MatrixXd numeric =
      ObservabilityMatrix<4, double>(DragSystem{}, {0.3, 1.2, 0.7, 2.0}, {}, 4);
  FillDirections(numeric, std::vector<StateInfo>(4), &report);
  const Eigen::Vector3d direction = report.blocks[0].directions.col(0);
  EXPECT_LT((direction - Eigen::Vector3d(1.0, 4.0, -2.0 / 0.3)).norm(), 1e-9);
}

TEST(ExactRank, AtRestTheDragIsNotSeen) {
  const std::vector<Modular> x = {Modular(0.3), Modular(0.0), Modular(0.7), Modular(2.0)};
  const RankReport report =
      ExactRank(ObservabilityMatrix<4, Modular>(DragSystem{}, x, {}, 4), {0, 1, 2, 3});
  EXPECT_EQ(report.rank, 2);
  EXPECT_EQ(report.StatusOf(1), "ok");  // v = 0 is observable: changing it would move y
  EXPECT_EQ(report.StatusOf(2), "unobservable");
  EXPECT_EQ(report.StatusOf(0), report.StatusOf(3));
}

TEST(ExactRank, KnownStatesAreLeftOut) {
  const std::vector<Modular> x = {Modular(0.3), Modular(1.2), Modular(0.7), Modular(2.0)};
  const auto o = ObservabilityMatrix<4, Modular>(DragSystem{}, x, {}, 4);
  EXPECT_EQ(ExactRank(o, {0, 1, 2}).nullity(), 0);
}

TEST(ExactRank, IndependentTiesAreSeparateBlocks) {
  DynamicMatrix<Modular> o(2, 5);  // y1 = a + 2 b, y2 = c - d; e is in neither
  const double rows[2][5] = {{1, 2, 0, 0, 0}, {0, 0, 1, -1, 0}};
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 5; ++j) o(i, j) = Modular(rows[i][j]);
  }
  const RankReport report = ExactRank(o, {0, 1, 2, 3, 4});
  ASSERT_EQ(report.blocks.size(), 3u);
  EXPECT_EQ(report.blocks[0].label, "J1");
  EXPECT_EQ(report.blocks[1].label, "J2");
  EXPECT_EQ(report.StatusOf(4), "unobservable");
}

TEST(NumericalRank, AgreesWithTheExactOne) {
  Eigen::MatrixXd k = Eigen::MatrixXd::Random(50, 4);
  k.col(3) = -2.0 * k.col(1);
  const RankReport report = NumericalRank(k, {0, 1, 2, 3}, 1e-9);
  EXPECT_FALSE(report.exact);
  EXPECT_EQ(report.rank, 3);
  ASSERT_EQ(report.blocks.size(), 1u);
  EXPECT_EQ(report.blocks[0].states, (std::vector<int>{1, 3}));
}

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

// --- Table I of Boehm et al. 2020 and its extensions, exactly.

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
