// trueline-export: the files of each target, read back and flown by equations of their own.
#include "problems/simulators/audit.h"
#include "problems/simulators/export_vehicle.h"
#include "problems/simulators/vehicle_replay.h"
#include "tests/common/test_files.h"
#include "tests/simulators/independent_replay.h"
#include "tests/simulators/made_vehicle.h"

namespace trueline {
namespace {

constexpr double kSpeed = 3.0;    // m/s
constexpr double kWithin = 0.01;  // of the way flown

// m, between Trueline's replay of the model and the simulator's of the file, at the worst time, and
// the way flown (m).
void ExpectSameFlight(const NeutralVehicle& model, const replay::Simulator& simulator) {
  const Replay own = FlyPulses(model, kSpeed, 1.0);
  replay::State start;
  start.v = Eigen::Vector3d(kSpeed, -kSpeed / 3.0, 0.0);
  start.p.z() = 1.0;
  const std::vector<replay::State> other = replay::Fly(
      simulator, start, [&](double t) { return PulsesAt(model, t); }, 1.0);
  ASSERT_EQ(own.states.size(), other.size());
  double worst = 0.0, way = 0.0, turned = 0.0;
  for (std::size_t i = 0; i < other.size(); ++i) {
    const Eigen::Vector3d p = own.states[i].segment<3>(RotorDrivenModel::kPosition);
    const Eigen::Vector3d in_world(other[i].p.x(), -other[i].p.y(), -other[i].p.z());
    worst = std::max(worst, (p - in_world).norm());
    const Eigen::Quaterniond q(own.states[i][0], own.states[i][1], own.states[i][2],
                               own.states[i][3]);
    turned = std::max(turned, q.angularDistance(Eigen::Quaterniond::Identity()));
    if (i > 0) way += (other[i].p - other[i - 1].p).norm();
  }
  EXPECT_LT(worst, kWithin * way) << "of a way of " << way << " m";
  EXPECT_GT(turned, 0.05) << "rad: the flight turns";
  testing::Test::RecordProperty("error_m", std::to_string(worst));
}

class ExportTest : public testing::Test {
 protected:
  // The files in the test's folder; `model` as the target's rotors are ordered.
  Export Write(const NeutralVehicle& model, const std::string& to) {
    const Target& target = FindTarget(to);
    Export exported = ExportVehicle(model, target);
    out_ = folder_ / ("vehicle" + exported.files[0].extension);
    WriteExport(exported, target, out_);
    return exported;
  }
  std::filesystem::path Beside(const char* extension) const {
    std::filesystem::path path = out_;
    return path.replace_extension(extension);
  }

  TestFolder folder_;
  std::filesystem::path out_;
};

NeutralVehicle With(std::initializer_list<std::pair<const char*, double>> more,
                    double gravity = 9.81) {
  NeutralVehicle vehicle = MadeQuadrotor();
  vehicle.gravity = gravity;
  for (const auto& [name, value] : more) vehicle.body[name] = value;
  return vehicle;
}

// Its thrust falls by 1/25 for each m/s along the axis, which is no parameter of any file: the
// flight is the same but for that, and the export says so.
TEST_F(ExportTest, Px4ClassicFliesTheSameButForItsLossOfThrust) {
  const Export e = Write(With({{"rotor_speed_drag", 1e-4}, {"tau", 0.03}}, 9.8), "px4_classic");
  ExpectSameFlight(e.vehicle, replay::LoadGazebo(out_, false));
  EXPECT_THAT(LossText(e, FindTarget("px4_classic")), HasSubstr("1/25"));
}

// Its inertia is that of a box: what no box has is said.
TEST_F(ExportTest, AirSimLosesDrag) {
  const Export e = Write(With({{"K_x", -0.3}, {"tau", 0.03}, {"full_speed", 2200.0}}), "airsim");
  ASSERT_EQ(e.lost.size(), 1u);
  EXPECT_EQ(e.lost[0].name, "K_x");
}

// The file of a target flies as the vehicle that it was made of, which loses nothing there.
struct Same {
  const char* to;
  NeutralVehicle vehicle;
  replay::Simulator (*load)(const std::filesystem::path& file);
};
void PrintTo(const Same& same, std::ostream* out) { *out << same.to; }

class FliesTheSame : public ExportTest, public testing::WithParamInterface<Same> {};

TEST_P(FliesTheSame, AndLosesNothing) {
  const Export e = Write(GetParam().vehicle, GetParam().to);
  ExpectSameFlight(e.vehicle, GetParam().load(out_));
  EXPECT_TRUE(e.lost.empty()) << e.lost.front().name;
}

constexpr double kAtFull = 2200.0;  // rad/s
const std::pair<const char*, double> kSpeedDrag{"rotor_speed_drag", 1e-4}, kLagged{"tau", 0.03},
    kFull{"full_speed", kAtFull}, kShifted{"r_BM_x", 0.002};

INSTANTIATE_TEST_SUITE_P(
    Export, FliesTheSame,
    testing::Values(
        Same{"rotorpy",
             With({kSpeedDrag,
                   {"rotor_inflow", 3e-6},
                   {"translational_lift", 0.01},
                   {"c_x", 0.02},
                   {"c_y", 0.02},
                   {"tau", 0.04},
                   {"r_BM_x", 0.0005}}),
             replay::LoadRotorPy},
        Same{"gz", With({kSpeedDrag, kLagged}, 9.8),
             [](const auto& file) { return replay::LoadGazebo(file, false); }},
        Same{"px4_sih",
             With({{"K_x", -0.3}, {"K_y", -0.3}, {"K_z", -0.3}, kLagged, kFull}, 9.80665),
             [](const auto& file) { return replay::LoadSih(file, kAtFull); }},
        Same{"gym_pybullet_drones", With({kSpeedDrag, {"rotor_inflow", 1e-4}}, 9.8),
             replay::LoadGymPybullet},
        Same{"pyflyt", With({{"c_x", 0.02}, {"c_y", 0.02}, {"c_z", 0.02}, kLagged}),
             [](const auto& file) {
               return replay::LoadPyFlyt(file,
                                         std::filesystem::path(file).replace_extension(".urdf"));
             }},
        Same{"mujoco", With({kLagged, kFull, kShifted}),
             [](const auto& file) { return replay::LoadMujoco(file, kAtFull); }},
        Same{"airsim", With({kLagged, kFull}),
             [](const auto& file) { return replay::LoadAirSim(file, kAtFull); }},
        Same{"isaac_lab", With({kLagged, kFull}),
             [](const auto& file) { return replay::LoadIsaacLab(file, kAtFull); }},
        Same{"crazyflow",
             With({{"K_x", -0.3}, {"K_y", -0.4}, {"K_z", -0.2}, {"tau", 0.05}, kShifted}),
             replay::LoadCrazyflow},
        Same{"flightmare",
             With({{"K_x", -0.3},
                   {"K_y", -0.4},
                   {"K_z", -0.2},
                   {"translational_lift", 0.01},
                   {"tau", 0.05},
                   kShifted}),
             replay::LoadFlightmare},
        Same{"rotors", With({kSpeedDrag, kLagged}, 9.8), replay::LoadRotorS}),
    [](const auto& info) { return std::string(info.param.to); });

// What is written is read back by every target, and has no fault.
TEST_F(ExportTest, EveryTargetReadsBackWithoutFault) {
  const NeutralVehicle model =
      With({{"K_x", -0.3}, {"K_y", -0.3}, {"K_z", -0.2}, {"tau", 0.04}, {"full_speed", 2200.0}});
  int count = 0;
  for (const Target& target : Targets()) {
    if (target.skeletons.empty()) continue;
    const Export e = Write(model, target.name);
    std::vector<std::string> paths = {out_.string()};
    if (e.files.size() > 1) paths.push_back(Beside(e.files[1].extension.c_str()).string());
    const std::vector<VehicleFile> read = ReadVehicleFiles(paths);
    ASSERT_EQ(read.size(), 1U) << target.name;
    EXPECT_EQ(read[0].target->name, target.name);
    EXPECT_TRUE(read[0].vehicle.Flies()) << target.name;
    EXPECT_NEAR(read[0].vehicle.Get("m"), 0.2463, 1e-6) << target.name;
    EXPECT_NEAR(read[0].vehicle.Get("I_y") / 0.678e-3, 1.0, 1e-4) << target.name;
    for (const Contradicted& finding : CheckVehicle(read[0])) {
      const bool drag = finding.parameter.find("K") != std::string::npos;
      EXPECT_TRUE(drag) << target.name << ": " << finding.text;
    }
    ++count;
  }
  EXPECT_GE(count, 8);
}

TEST_F(ExportTest, StatesWhatIsLostAndItsCost) {
  const Export e = Write(
      With({{"K_x", -0.4}, {"K_y", -0.4}, {"translational_lift", 0.05}, {"tau", 0.03}}), "mujoco");
  std::vector<std::string> names;
  for (const Loss& loss : e.lost) names.push_back(loss.name);
  EXPECT_THAT(names, UnorderedElementsAre("K_x", "K_y", "translational_lift"));
  ASSERT_TRUE(e.lost[0].cost);
  // Drag of 0.4 1/s at 5 m/s: 2 m/s^2 and more, half a second squared over two.
  EXPECT_NEAR(*e.lost[0].cost, 0.25, 0.05);
  EXPECT_THAT(ReadText(out_.string() + ".lost.yaml"), HasSubstr("translational_lift"));
}

TEST_F(ExportTest, PutsDragInTheFormThatTheTargetHas) {
  const Export e = Write(With({{"K_x", -0.3}, {"K_y", -0.3}, {"tau", 0.03}}, 9.8), "gz");
  EXPECT_NEAR(e.read.Get("rotor_speed_drag") * e.read.Get("S_h"), 0.3, 0.01);
  EXPECT_LT(e.cost, 0.02);
}

TEST(ExportErrors, NamesTheTargets) {
  EXPECT_THAT(ErrorOf([] { FindTarget("unreal"); }), HasSubstr("px4_sih"));
}

TEST(ExportErrors, RefusesSixRotorsWhereFourAreFixed) {
  NeutralVehicle hexa = MadeQuadrotor();
  hexa.rotors.push_back(hexa.rotors[0]);
  hexa.rotors.push_back(hexa.rotors[1]);
  EXPECT_THAT(ErrorOf([&] { ExportVehicle(hexa, FindTarget("px4_sih")); }), HasSubstr("6"));
}

}  // namespace
}  // namespace trueline
