
#include <Eigen/LU>
#include <cmath>
#include <filesystem>

#include "problems/observability/assessment.h"
#include "problems/observability/observe.h"
#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/rotor_flight.h"
#include "problems/trajectory/trajectory_config.h"
#include "tests/common/test_files.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

const std::filesystem::path kConfigs = TRUELINE_TEST_SOURCE_DIR "/config/observe";

std::vector<CaseResult> RunFile(const std::string& name) {
  return RunObserveConfig(YamlMap::FromFile(kConfigs / name), nullptr);
}

std::vector<CaseResult> RunText(const std::string& cases) {
  const YAML::Node file = YAML::LoadFile((kConfigs / "table1.yaml").string());
  YAML::Node config;
  config["vehicle"] = file["vehicle"];
  config["cases"] = YAML::Load(cases);
  return RunObserveConfig(YamlMap(config, "test.yaml", ""), nullptr);
}

const CaseResult& Find(const std::vector<CaseResult>& cases, const std::string& name) {
  for (const CaseResult& result : cases) {
    if (result.name == name) return result;
  }
  throw std::runtime_error("no case " + name);
}

TEST(ObserveConfig, SlowEveryFileThatShipsRuns) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kConfigs)) {
    const auto cases = RunFile(entry.path().filename());
    EXPECT_FALSE(cases.empty());
    const YAML::Node yaml = YAML::Load(ObservabilityYaml(cases, "x.yaml"));
    ASSERT_EQ(yaml["cases"].size(), cases.size()) << entry.path();
    for (std::size_t i = 0; i < cases.size(); ++i) {
      EXPECT_EQ(yaml["cases"][i]["rank"].as<int>(), cases[i].rank.rank);
      EXPECT_EQ(yaml["cases"][i]["per_state"].size(), cases[i].rank.states.size());
    }
    ++files;
  }
  EXPECT_GE(files, 4);
}

TEST(ObserveConfig, TableOneHasThePapersNumbers) {
  const auto cases = RunFile("table1.yaml");
  EXPECT_EQ(Find(cases, "IMU only, inputs constant").rank.rank, 17);
  EXPECT_EQ(Find(cases, "IMU only, inputs varying").rank.rank, 18);
  EXPECT_EQ(Find(cases, "GNSS only, inputs varying").rank.rank, 21);
  EXPECT_EQ(Find(cases, "IMU and pose, inputs constant").rank.rank, 30);
  EXPECT_EQ(Find(cases, "IMU and pose, inputs constant").states, 31);
  EXPECT_NE(ObservabilityYaml(cases, "t").find("states: [r_BM_z, r_BP_z], direction: {r_BM_z: 1, "),
            std::string::npos);
  EXPECT_EQ(
      ObservabilityBrief({Find(cases, "Pose only, inputs constant")}),
      "Pose only, inputs constant: rank 21 of 30 (exact); only jointly r_BM_z, r_BP_z; not seen "
      "r_BI_x, r_BI_y, b_a_x, b_a_y, b_a_z, b_w_x, b_w_y, b_w_z\n");
}

// The numerical rank of a flight, by singular values, is the exact one of its kind of motion.
TEST(ObserveConfig, SlowFlightsShowWhatTheirKindOfMotionShowsExactly) {
  const auto flights = RunFile("flights.yaml"), kinds = RunFile("extended.yaml");
  for (const char* name : {"hover", "straight ahead and back"}) {
    const RankReport& flight = Find(flights, name).rank;
    const RankReport& exact = Find(kinds, name).rank;
    EXPECT_EQ(flight.rank, exact.rank) << name;
    for (const int state : exact.states) {
      EXPECT_EQ(flight.StatusOf(state).substr(0, 2), exact.StatusOf(state).substr(0, 2))
          << name << " " << state;
    }
  }
  EXPECT_EQ(Find(flights, "lissajous").rank.rank, 30);
}

TEST(ObserveConfig, SlowAdviceForInertiaIsToTurnAboutItsAxis) {
  const auto cases = RunFile("flights.yaml");
  const CaseResult& hover = Find(cases, "hover");
  const auto advice = [&](const char* state) -> std::string {
    for (const Advice& each : hover.advice) {
      if (hover.info[each.state].name == state) return each.manoeuvre;
    }
    return "";
  };
  EXPECT_EQ(advice("I_x"), "left and right");
  EXPECT_EQ(advice("I_y"), "forward and back");
  EXPECT_EQ(advice("I_z"), "turning left and right on the spot");
}

void ExpectRefused(const std::string& cases, const std::string& part) {
  EXPECT_THAT(ErrorOf([&] { RunText(cases); }), AllOf(HasSubstr(part), HasSubstr("test.yaml:")));
}

TEST(ObserveConfig, MistakesAreNamed) {
  ExpectRefused("[{name: a, sensors: [radar]}]", "'radar' is no sensor");
  ExpectRefused("[{name: a, sensors: [imu], free: [r_XY]}]", "'r_XY' is no state");
  ExpectRefused("[{name: a, sensors: [imu], inputs: wild}]", "'wild' is not known");
  ExpectRefused("[{name: a, sensors: [imu], motion: any}]", "unknown key");
  ExpectRefused("[{sensors: [imu]}]", "'cases[0].name' is missing");
  ExpectRefused("[]", "names no case");
  ExpectRefused("[{name: a, sensors: [imu], trajectory: {kind: lissajous, amplitude: [1, 2]}}]",
                "needs 4 numbers");
  ExpectRefused("[{name: a, sensors: [imu], trajectory: {kind: file}}]", "file' is missing");
  ExpectRefused("[{name: a, sensors: [imu], trajectory: {kind: hover, seed: 3}}]", "unknown key");
}

TEST(FlightLimits, ASpeedStatedTwiceIsRefused) {
  const YamlMap map(YAML::Load("{max_speed: 1500, max_speed_rpm: 16400}"), "limits.yaml", "");
  EXPECT_THROW(ReadLimits(map), InputError);
}

TEST(VehicleConfig, BodiesThatCannotExistAreRefused) {
  YAML::Node node = YAML::LoadFile((kConfigs / "table1.yaml").string())["vehicle"];
  node["inertia"] = YAML::Load("[1e-3, 1e-3, 3e-3]");
  EXPECT_THROW(ReadRotorVehicle(YamlMap(node, "v.yaml", ""), 9.81), InputError);
}

RotorFlight MadeFlight() {
  Lissajous figure;
  figure.amplitude << 0.4, 0.4, 0.15, 1.0;
  figure.frequency << 0.5, 0.6, 0.7, 0.4;
  return {{TestQuadrotor(), TestNominal()}, LissajousPath(figure, 4.0)};
}

// A log made from a trajectory, all streams at 1000 Hz.
FlightLog MadeLog(const RotorFlight& flight) {
  FlightLog log;
  log.name = "made", log.directory = "made";
  for (int i = 0; i <= 4000; ++i) {
    const NominalPoint point = flight.At(i * 1e-3);
    const double* x = point.x.data();
    const TimeNs t = FromSeconds(i * 1e-3);
    log.mocap.push_back({t, {x[4], x[5], x[6]}, {x[0], x[1], x[2], x[3]}});
    log.imu.push_back({t, {0, 0, 0}, {x[10], x[11], x[12]}});
    std::vector<double> speeds;
    for (const double u : point.u) speeds.push_back(std::sqrt(u));
    log.rotors.push_back({t, speeds});
  }
  return log;
}

// `keys` beside the vehicle.
std::vector<CaseResult> AskLog(const FlightLog& log, const std::string& keys) {
  YAML::Node config = YAML::Load(keys);
  config["vehicle"] = YAML::LoadFile((kConfigs / "table1.yaml").string())["vehicle"];
  return RunObserveLog(log, YamlMap(config, "v.yaml", ""), nullptr);
}

void ExpectSameSigmas(const CaseResult& is, const CaseResult& want, double share) {
  ASSERT_EQ(is.sigma.size(), want.sigma.size());
  for (std::size_t i = 0; i < want.sigma.size(); ++i) {
    if (std::isnan(want.sigma[i])) continue;
    EXPECT_NEAR(is.sigma[i] / want.sigma[i], 1.0, share) << i;
  }
}

// A log made from a trajectory gives the bounds of the trajectory.
TEST(ObserveLog, FlightFromALogIsTheFlight) {
  const RotorFlight flight = MadeFlight();
  const auto cases = AskLog(MadeLog(flight), "{sensors: {imu_rate: 250, pose_rate: 30}}");
  ASSERT_EQ(cases.size(), 1u);
  EXPECT_EQ(cases[0].rank.rank, 30);

  const RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  FlightQuestion question;
  question.states = system.PaperStates();
  ExpectSameSigmas(cases[0], ObserveFlight(system, flight.Nominal(), question), 0.02);
}

TEST(ObserveLog, RatesAreTheLogsUnlessTheyAreStated) {
  const FlightLog log = MadeLog(MadeFlight());
  ExpectSameSigmas(AskLog(log, "{}")[0],
                   AskLog(log, "{sensors: {imu_rate: 1000, pose_rate: 1000}}")[0], 0.001);
}

TEST(ObserveLog, KeysOfTheConfigurationAreUsedOrRefused) {
  const FlightLog log = MadeLog(MadeFlight());
  EXPECT_EQ(AskLog(log, "{horizon: 0.4}")[0].horizon, 0.4);
  EXPECT_THROW(AskLog(log, "{nonsense: 1}"), InputError);
  EXPECT_THROW(AskLog(log, "{limits: {nonsense: 1}}"), InputError);
  FlightLog without = log;
  without.rotors.clear();
  for (const PoseSample& pose : log.mocap) without.attitude.push_back({pose.t, pose.q_E});
  EXPECT_THROW(AskLog(without, "{}"), InputError);
}

TEST(ObserveLog, LogWithNothingToAskIsRefused) {
  FlightLog log;
  log.directory = "empty";
  EXPECT_THROW(RunObserveLog(log, std::nullopt, nullptr), InputError);
}

// Constant-velocity motion, position measured with density 1 over T: K = (1, t), and the Gramian is
// (T, T^2/2; T^2/2, T^3/3); marginalising position leaves T^3/12 for velocity.
Eigen::Matrix2d ConstantVelocityGramian(double T) {
  return (Eigen::Matrix2d() << T, T * T / 2, T * T / 2, T * T * T / 3).finished();
}

TEST(Assessment, BoundOfConstantVelocityIsTheOneInClosedForm) {
  const double T = 4.0;
  const Assessment a = Assess(ConstantVelocityGramian(T), {0, 1}, std::vector<StateInfo>(2));
  EXPECT_NEAR(a.sigma[0], std::sqrt(4.0 / T), 1e-12);
  EXPECT_NEAR(a.sigma[1], std::sqrt(12.0 / (T * T * T)), 1e-12);
  EXPECT_NEAR(SchurComplement(ConstantVelocityGramian(T), {1}, {0})(0, 0), T * T * T / 12, 1e-12);
}

TEST(Assessment, LostSumOfTwoStatesIsNamedAndTheOthersKeepTheirBound) {
  Eigen::MatrixXd k = Eigen::MatrixXd::Random(40, 3);
  k.col(2) = -500.0 * k.col(0);  // states 0 and 2 act as one
  std::vector<StateInfo> info(3);
  const Assessment a = Assess(k.transpose() * k, {0, 1, 2}, info);
  EXPECT_EQ(a.rank.rank, 2);
  EXPECT_EQ(a.rank.StatusOf(0), "joint: J1");
  EXPECT_TRUE(std::isinf(a.sigma[0]));
  const Eigen::MatrixXd two = k.leftCols(2).transpose() * k.leftCols(2);
  EXPECT_NEAR(a.sigma[1], std::sqrt(two.inverse()(1, 1)), 1e-9);
  EXPECT_NEAR(a.rank.blocks[0].directions(1, 0), 1.0 / 500.0, 1e-8);
}

TEST(Assessment, StateThatNoOutputDependsOnIsUnobservable) {
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(3, 3);
  information.topLeftCorner<2, 2>() = ConstantVelocityGramian(2.0);
  const Assessment a = Assess(information, {0, 1, 2}, std::vector<StateInfo>(3));
  EXPECT_EQ(a.rank.StatusOf(2), "unobservable");
  EXPECT_TRUE(std::isinf(a.sigma[2]));
  EXPECT_TRUE(std::isfinite(a.sigma[0]));
}

TEST(Assessment, ScoresOfADiagonalGramian) {
  const GramianScores s = ScoreGramian(Eigen::Vector3d(4.0, 0.25, 1.0).asDiagonal());
  EXPECT_DOUBLE_EQ(s.sigma_min, 0.25);
  EXPECT_DOUBLE_EQ(s.condition, 16.0);
  EXPECT_NEAR(s.log10_determinant, 0.0, 1e-15);
  EXPECT_NEAR(s.per_state[1], 0.25, 1e-15);
}

TEST(Assessment, ScoreDoesNotDependOnTheScaleOfWhatIsMarginalised) {
  const Eigen::MatrixXd k = Eigen::MatrixXd::Random(20, 4);
  const Eigen::MatrixXd w = k.transpose() * k;
  const GramianScores a = ScoreStates(w, {1, 2}, {0, 1, 2, 3}, {1, 1, 1, 1});
  const GramianScores b = ScoreStates(w, {1, 2}, {0, 1, 2, 3}, {1e3, 1, 1, 1e-3});
  EXPECT_NEAR(a.sigma_min, b.sigma_min, 1e-9 * a.sigma_min);
  const GramianScores known = ScoreStates(w, {1, 2}, {1, 2}, {1, 1, 1, 1});
  EXPECT_GT(known.sigma_min, a.sigma_min);
}

}  // namespace
}  // namespace trueline
