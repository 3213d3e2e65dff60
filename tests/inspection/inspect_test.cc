// Faults put into a simulated flight: each is named on its stream, and the corrected map gives the
// good log back.
#include <fstream>
#include <functional>
#include <random>

#include "problems/import/convert.h"
#include "problems/import/find_map.h"
#include "problems/import/formats/open_recording.h"
#include "problems/inspection/corrected_map.h"
#include "problems/inspection/inspection.h"
#include "problems/inspection/motion.h"
#include "problems/log/native_log.h"
#include "problems/result/yaml_text.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "tests/common/test_files.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

const FlightLog& GoodLog() {
  static const FlightLog log = testing_simulation::LogOf("hippodrome", 40.0, 5);
  return log;
}

// id and stream of what is worse than a note.
std::vector<std::string> Harmful(const Inspection& inspection) {
  std::vector<std::string> names;
  for (const Finding& finding : inspection.findings) {
    if (finding.level != Level::kNote)
      names.push_back(finding.kind->id + (" of " + finding.stream));
  }
  return names;
}

// The log as converted by the map that an inspection corrected.
FlightLog Repaired(const FlightLog& bad, Inspection* inspection) {
  TestFolder folder;
  WriteNativeLog(bad, folder / "log");
  const FlightLog read = ReadNativeLog(folder / "log");
  *inspection = Inspect(read, {});
  const NativeMap native = MapOfNativeLog(read);
  std::ofstream(folder / "map.yaml") << TextOf(CorrectMap(native.map, inspection->repairs));
  return ConvertLog(ReadImportMap(folder / "map.yaml"), native.files, {});
}

void ExpectLikeGood(const FlightLog& log) {
  const FlightLog& good = GoodLog();
  ASSERT_EQ(log.imu.size(), good.imu.size());
  double accel = 0.0, gyro = 0.0;
  for (std::size_t i = 0; i < good.imu.size(); ++i) {
    accel += (log.imu[i].accel - good.imu[i].accel).squaredNorm();
    gyro += (log.imu[i].gyro - good.imu[i].gyro).squaredNorm();
  }
  EXPECT_LT(std::sqrt(accel / static_cast<double>(good.imu.size())), 0.4);
  // The laps turn about nearly one axis, so an axis that was mirrored or swapped comes back as a
  // rotation that fits these turns alike.
  EXPECT_LT(std::sqrt(gyro / static_cast<double>(good.imu.size())), 0.12);
  ASSERT_EQ(log.attitude.size(), good.attitude.size());
  ASSERT_EQ(log.mocap.size(), good.mocap.size());
  const std::size_t k = good.mocap.size() / 2, a = good.attitude.size() / 2;
  EXPECT_NEAR(SecondsBetween(good.mocap[k].t, log.mocap[k].t), 0.0, 0.006);
  // The filter's own lag stays: below 12 ms it is no finding.
  EXPECT_NEAR(SecondsBetween(good.attitude[a].t, log.attitude[a].t), 0.0, 0.012);
  EXPECT_LT(good.mocap[k].q_E.angularDistance(log.mocap[k].q_E), 0.06);
  EXPECT_LT(good.attitude[a].q_Ep_I.angularDistance(log.attitude[a].q_Ep_I), 0.06);
  EXPECT_LT((good.mocap[k].p_E - log.mocap[k].p_E).norm(), 0.05);
}

using Change = std::function<void(FlightLog*)>;

// A change of each sample of a stream.
template <auto stream>
Change EachOf(const auto& change) {
  return [=](FlightLog* log) {
    for (auto& sample : log->*stream) change(sample);
  };
}
Change EachImu(const auto& change) { return EachOf<&FlightLog::imu>(change); }
Change EachAttitude(const auto& change) { return EachOf<&FlightLog::attitude>(change); }
Change EachMocap(const auto& change) { return EachOf<&FlightLog::mocap>(change); }
Change EachFix(const auto& change) { return EachOf<&FlightLog::fixes>(change); }
Change EachRotors(const auto& change) { return EachOf<&FlightLog::rotors>(change); }

Change TurnedImu(const Eigen::Matrix3d& turn) {
  return EachImu([turn](ImuSample& s) { s = {s.t, turn * s.accel, turn * s.gyro}; });
}

struct PutFault {
  const char* name;
  const char* finding;
  Change put;
};

class InspectFault : public testing::TestWithParam<PutFault> {};

TEST_P(InspectFault, IsNamedAndRepaired) {
  FlightLog bad = GoodLog();
  GetParam().put(&bad);
  Inspection inspection;
  const FlightLog repaired = Repaired(bad, &inspection);
  EXPECT_THAT(Harmful(inspection), Contains(GetParam().finding));
  ExpectLikeGood(repaired);
}

Eigen::Quaterniond Shuffled(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }
const Eigen::Matrix3d kSwap{{0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
const Eigen::Matrix3d kUp = Eigen::Vector3d(1, -1, -1).asDiagonal();
const Eigen::Quaterniond kFlip(0.0, 1.0, 0.0, 0.0);

Eigen::Quaterniond Turn(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}
Change TurnedHeading(double angle) {
  return EachAttitude([turn = Turn(angle, Eigen::Vector3d::UnitZ())](AttitudeSample& s) {
    s.q_Ep_I = turn * s.q_Ep_I;
  });
}
Change Accel(const std::function<void(Eigen::Vector3d&)>& change) {
  return EachImu([change](ImuSample& s) { change(s.accel); });
}

const PutFault kFaults[] = {
    {"AxesSwapped", "imu_axes of imu", TurnedImu(kSwap)},
    {"ForwardLeftUp", "imu_axes of imu", TurnedImu(kUp)},
    {"AxesTurned", "imu_axes of imu", TurnedImu(Turn(1.1, {1.0, -2.0, 0.5}).toRotationMatrix())},
    {"GyroSign", "imu_axes of imu", EachImu([](ImuSample& s) { s.gyro.y() *= -1; })},
    {"GyroAboutDown", "imu_axes of imu", EachImu([](ImuSample& s) { s.gyro.z() *= -1; })},
    {"AccelerometerScale", "accelerometer_scale of imu", Accel([](auto& a) { a *= 0.9; })},
    {"AccelerometerSwapped", "accelerometer_axes of imu",
     Accel([](auto& a) { std::swap(a.x(), a.y()); })},
    {"AccelerometerReversed", "accelerometer_axes of imu",
     Accel([](auto& a) { std::swap(a.x(), a.z()); })},
    {"AccelerometerSign", "accelerometer_axes of imu", Accel([](auto& a) { a.x() *= -1; })},
    {"AccelerometerZ", "accelerometer_axes of imu", Accel([](auto& a) { a.z() *= -1; })},
    {"ClockASecondLate", "clock_offset of mocap",
     EachMocap([](PoseSample& s) { s.t += FromSeconds(1.0); })},
    {"AttitudeLateBy30ms", "clock_offset of attitude",
     EachAttitude([](AttitudeSample& s) { s.t += FromSeconds(0.03); })},
    {"AttitudeInAnotherHeading", "heading_offset of attitude", TurnedHeading(0.5 * M_PI)},
    {"QuaternionOrder", "quaternion_form of attitude",
     EachAttitude([](AttitudeSample& s) { s.q_Ep_I = Shuffled(s.q_Ep_I); })},
    {"QuaternionInverse", "quaternion_form of mocap",
     EachMocap([](PoseSample& s) { s.q_E = s.q_E.conjugate(); })},
    {"EarthUp", "earth_up of mocap", EachMocap([](PoseSample& s) {
       s = {s.t, kFlip * s.p_E, kFlip * s.q_E};
     })}};

INSTANTIATE_TEST_SUITE_P(Inspect, InspectFault, testing::ValuesIn(kFaults),
                         [](const auto& info) { return std::string(info.param.name); });

// Mocap that repeats the attitude is no second witness, whatever is wrong with either.
TEST(Inspect, KnowsACopyOnAnotherClockAndInAnotherForm) {
  FlightLog log = GoodLog();
  log.mocap.clear();
  for (std::size_t i = 0; i < log.attitude.size(); i += 5) {
    log.mocap.push_back({log.attitude[i].t, Eigen::Vector3d::Zero(), log.attitude[i].q_Ep_I});
  }
  const auto others = [&] { return AttitudesOf(log.mocap); };
  EXPECT_TRUE(RepeatsAttitude(log, others()));
  for (PoseSample& pose : log.mocap) {
    pose.t += FromSeconds(0.7);
    pose.q_E = Shuffled(pose.q_E).conjugate();
  }
  EXPECT_TRUE(RepeatsAttitude(log, others()));
  EXPECT_FALSE(RepeatsAttitude(log, AttitudesOf(GoodLog().mocap)));
}

// A quadrotor in a small laboratory. Its attitude filter errs by a slow tilt and is in time; mocap,
// and the fixes taken from it, are `late` (s).
FlightLog LaboratoryLog(const std::string& lissajous, double late) {
  const TestFolder folder;
  YAML::Node config =
      YAML::LoadFile(std::string(TRUELINE_TEST_SOURCE_DIR) + "/config/rotors/random.yaml");
  config["trajectory"] = YAML::Load("{kind: lissajous, duration: 30, " + lissajous + "}");
  for (const char* place : {"r_BM", "r_BP"}) config["vehicle"][place] = YAML::Load("[0, 0, 0]");
  config["biases"]["accel"] = YAML::Load("[0.05, -0.05, 0.1]");
  config["simulation"]["pose_rate"] = 100;
  config["simulation"]["noise"] = YAML::Load(
      "{sigma_accel: 0.3, sigma_gyro: 0.02, sigma_position: 0.001, sigma_attitude: 0.004, "
      "force_density: 0.05, angular_density: 0.2}");
  std::ofstream(folder / "flight.yaml") << config;
  const RotorFlightConfig flight = ReadRotorFlight(YamlMap::FromFile(folder / "flight.yaml"));
  FlightLog log = SimulateRotorFlight(flight.simulation, flight.path, 3);
  log.rotors.clear();
  for (PoseSample& pose : log.pose) {
    const double t = ToSeconds(pose.t);
    const Eigen::Vector3d error(0.012 * std::sin(0.31 * t), 0.012 * std::sin(0.23 * t), -0.008);
    const Eigen::AngleAxisd tilt(error.norm(), error.normalized());
    log.attitude.push_back({pose.t, Eigen::Quaterniond(tilt) * pose.q_E});
    pose.t += FromSeconds(late);
    if (log.attitude.size() % 20 == 0) log.fixes.push_back({pose.t, pose.p_E, 0.05, 0});
  }
  log.mocap = std::move(log.pose);
  log.pose.clear();
  return log;
}

TEST(Inspect, AHelixAndASlowFigureAccuseNobody) {
  for (const char* path :
       {"amplitude: [0.8, 0.8, 0.4, 0], frequency: [0.28, 0.28, 0.035, 0], phase: [0, 1.571, 0, 0]",
        "amplitude: [0.65, 0.65, 0.1, 0], frequency: [0.11, 0.085, 0.05, 0], phase: [0, 1, 0, "
        "0]"}) {
    EXPECT_THAT(Harmful(Inspect(LaboratoryLog(path, 0.0), {})), IsEmpty()) << path;
    EXPECT_THAT(Harmful(Inspect(LaboratoryLog(path, 0.05), {})),
                UnorderedElementsAre("clock_offset of mocap", "clock_offset of fixes"))
        << path;
  }
}

// Carried and turned on the ground: gravity is all that the accelerometer feels.
TEST(Inspect, AVehicleThatIsTurnedByHandHasNoThrust) {
  FlightLog log = GoodLog();
  log.mocap.clear();
  log.fixes.clear();
  for (std::size_t i = 0; i < log.attitude.size(); ++i) {
    const double t = ToSeconds(log.attitude[i].t - log.attitude[0].t);
    const Eigen::Vector3d turn(0.5 * std::sin(1.7 * t), 0.4 * std::sin(2.3 * t), 2.0 * t);
    log.attitude[i].q_Ep_I = Eigen::AngleAxisd(turn.z(), Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(turn.y(), Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(turn.x(), Eigen::Vector3d::UnitX());
  }
  log.imu.resize(log.attitude.size());
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    const Eigen::Quaterniond &q = log.attitude[i].q_Ep_I, &before = log.attitude[i - 1].q_Ep_I;
    const double dt = SecondsBetween(log.attitude[i - 1].t, log.attitude[i].t);
    const Eigen::AngleAxisd step(before.conjugate() * q);
    log.imu[i] = {log.attitude[i].t, q.conjugate() * Eigen::Vector3d(0, 0, -log.gravity),
                  step.axis() * step.angle() / dt};
  }
  EXPECT_THAT(Harmful(Inspect(log, {})), Not(Contains("not_specific_force of imu")));
}

// Leaves one of `count` samples.
void ThinImu(std::size_t count, FlightLog* log) {
  std::vector<ImuSample> few;
  for (std::size_t i = 0; i < log->imu.size(); i += count) few.push_back(log->imu[i]);
  log->imu = few;
}

FlightLog LongLog() { return testing_simulation::LogOf("hippodrome", 0.0, 3); }

// The mean force in earth is gravity; a bias of 0.9 g beside positions in another unit is not.
TEST(Inspect, RepairsTheAccelerometersUnitBeforeItJudgesPositions) {
  FlightLog log = LongLog();
  ThinImu(2, &log);
  Accel([](auto& a) { a /= 9.80665; })(&log);
  const Inspection inspection = Inspect(log, {});
  const auto harmful = Harmful(inspection);
  EXPECT_THAT(harmful, Contains("accelerometer_scale of imu"));
  EXPECT_THAT(harmful, Not(Contains("gravity_missing of imu")));
  EXPECT_THAT(harmful, Not(Contains("accelerometer_bias of imu")));
  EXPECT_DOUBLE_EQ(inspection.repairs.streams.at("imu").accel_scale, 9.80665);
  EXPECT_EQ(inspection.repairs.streams.count("mocap"), 0U);
}

// Positions can't be in another unit by an accelerometer that reads no gravity.
TEST(Inspect, ScalesNoPositionsByAForceWithoutGravity) {
  FlightLog log = LongLog();
  std::size_t k = 0;
  for (ImuSample& sample : log.imu) {
    while (k + 1 < log.attitude.size() && log.attitude[k + 1].t <= sample.t) ++k;
    const Eigen::Vector3d up(0.0, 0.0, log.gravity);
    sample.accel += log.attitude[k].q_Ep_I.conjugate() * up;
  }
  const Inspection inspection = Inspect(log, {});
  EXPECT_THAT(Harmful(inspection), Contains("gravity_missing of imu"));
  EXPECT_THAT(Harmful(inspection), Not(Contains("accelerometer_bias of imu")));
  EXPECT_THAT(Harmful(inspection), Not(Contains("position_scale of mocap")));
}

// Noise of mocap's attitude makes the ratio of rates larger than the factor of degrees.
TEST(Inspect, NamesTheGyroscopesUnitByANoisyAttitude) {
  FlightLog log = GoodLog();
  log.attitude.clear();
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 0.018);  // rad
  for (PoseSample& pose : log.mocap) {
    const Eigen::Vector3d error(normal(random), normal(random), normal(random));
    pose.q_E = pose.q_E * Eigen::AngleAxisd(error.norm(), error.normalized());
  }
  for (ImuSample& sample : log.imu) sample.gyro *= 180.0 / M_PI;
  const Inspection inspection = Inspect(log, {});
  EXPECT_THAT(Harmful(inspection), Contains("gyro_scale of imu"));
  EXPECT_DOUBLE_EQ(inspection.repairs.streams.at("imu").gyro_scale, M_PI / 180.0);
}

// A frame count read as ms: turns go with the unit of time, accelerations with its square.
TEST(Inspect, NamesTheUnitOfAllStampsTogether) {
  for (const double unit : {0.2, 2.0}) {
    FlightLog log = GoodLog();
    ForEachStream(log, [&](const Stream&, auto& samples) {
      for (auto& sample : samples) sample.t = FromSeconds(unit * ToSeconds(sample.t));
    });
    const Inspection inspection = Inspect(log, {});
    EXPECT_THAT(Harmful(inspection), ElementsAre("time_scale of imu")) << unit;
    EXPECT_NEAR(inspection.findings.front().size * unit, 1.0, 0.05);
  }
  FlightLog scaled = GoodLog();  // the gyroscope alone is off
  for (ImuSample& sample : scaled.imu) sample.gyro *= 0.5;
  EXPECT_THAT(Harmful(Inspect(scaled, {})), Not(Contains("time_scale of imu")));
}

// A drift that turns the heading by 17 deg on average is no offset, which a map would turn.
TEST(Inspect, AHeadingThatDriftsIsNoOffset) {
  FlightLog log = testing_simulation::LogOf("fast", 0.0, 1, {{"heading_drift", {{"d", 0.006}}}});
  log.mocap.clear();
  const Inspection inspection = Inspect(log, {});
  EXPECT_THAT(Harmful(inspection), Contains("heading_drift of attitude"));
  EXPECT_THAT(Harmful(inspection), Not(Contains("heading_offset of attitude")));
  EXPECT_EQ(inspection.repairs.streams.count("attitude"), 0u);
}

// Without mocap, an attitude filter that takes acceleration for tilt looks like another heading on
// laps of one direction.
TEST(Inspect, AFilterThatFollowsAccelerationIsNoHeading) {
  for (const char* course : {"hippodrome", "iros2016"}) {
    FlightLog log =
        testing_simulation::LogOf(course, 0.0, 1, {{"ahrs_acceleration_error", {{"k", 0.5}}}});
    log.mocap.clear();
    const Inspection inspection = Inspect(log, {});
    EXPECT_THAT(Harmful(inspection), Not(Contains("heading_offset of attitude")));
    EXPECT_EQ(inspection.repairs.streams.count("attitude"), 0u);
    EXPECT_THAT(inspection.notes, Contains(HasSubstr("ahrs_acceleration_error")));
  }
}

// A throw is one manoeuvre: its motor commands fit the angular acceleration at many lags.
TEST(Inspect, OneManoeuvreIsNoClockOfMotors) {
  const auto file = DataFolder() / "../logs/betaflight/indiflight_LOG00271.BFL";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing";
  const auto map = FindShippedMap(*OpenRecording(file));
  ASSERT_TRUE(map.has_value());
  const FlightLog log = ConvertLog(*map, {file.string()}, {});
  EXPECT_THAT(Harmful(Inspect(log, {})), Not(Contains("clock_offset of motors")));
}

// A flight driven by its rotors, whose speeds and places the log states.
FlightLog FigureOfEight() { return testing_simulation::LogOf("figure_eight", 30.0, 3); }

TEST(Inspect, FindsRotorsOutOfOrderAndSpinsTurnedRound) {
  const FlightLog good = FigureOfEight();
  ASSERT_FALSE(good.rotors.empty());
  EXPECT_THAT(Harmful(Inspect(good, {})), Not(Contains(HasSubstr("rotor"))));
  FlightLog bad = good;
  for (ChannelsSample& sample : bad.rotors) {
    std::rotate(sample.values.begin(), sample.values.begin() + 1, sample.values.end());
  }
  Inspection inspection;
  const FlightLog repaired = Repaired(bad, &inspection);
  EXPECT_THAT(Harmful(inspection), Contains("rotor_order of rotors"));
  EXPECT_EQ(repaired.rotors[100].values, good.rotors[100].values);
  bad = good;
  for (Rotor& rotor : bad.vehicle->rotors) rotor.spin = -rotor.spin;
  const FlightLog turned = Repaired(bad, &inspection);
  EXPECT_THAT(Harmful(inspection), Contains("rotor_spins_reversed of rotors"));
  EXPECT_EQ(turned.vehicle->rotors[0].spin, good.vehicle->rotors[0].spin);
}

// Six rotors on a ring that a mixer drives by thrust and three moments: their squared speeds span
// four directions, so that the effects of single rotors are not determined.
FlightLog SixRotors() {
  FlightLog log;
  log.gravity = 9.81;
  Vehicle vehicle;
  Eigen::Matrix<double, 4, 6> effects;  // on thrust and moments
  for (int i = 0; i < 6; ++i) {
    const double angle = M_PI / 6.0 + i * M_PI / 3.0;
    Rotor rotor;
    rotor.position = {0.11 * std::cos(angle), 0.11 * std::sin(angle), 0.0};
    rotor.spin = i % 2 == 0 ? -1 : 1;
    rotor.k_f = 2.6e-7;
    rotor.k_m = 2.5e-9;
    vehicle.rotors.push_back(rotor);
    effects.col(i) << rotor.k_f,
        rotor.k_f * rotor.position.cross(rotor.axis) + rotor.spin * rotor.k_m * rotor.axis;
  }
  log.vehicle = vehicle;
  const Eigen::Matrix<double, 6, 4> mixer =
      effects.transpose() * (effects * effects.transpose()).inverse();
  const Eigen::Vector3d inertia(6e-4, 7e-4, 1.1e-3);
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::Vector4d wanted = Eigen::Vector4d::Zero();  // of unit size
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  for (int i = 0; i < 5000; ++i) {
    const TimeNs t = FromSeconds(0.004 * i);
    for (int k = 0; k < 4; ++k) wanted[k] += 0.004 / 0.1 * (2.0 * normal(random) - wanted[k]);
    const Eigen::Vector3d moment(3e-2 * wanted[1], 3e-2 * wanted[2], 4e-3 * wanted[3]);
    Eigen::Vector4d command;
    command << 2.4 + 0.3 * wanted[0], moment;
    const Eigen::VectorXd squares = (mixer * command).cwiseMax(1e4);
    const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
    w += 0.004 * (moment.cwiseQuotient(inertia) - 2.0 * w);
    log.imu.push_back({t, {0.0, 0.0, -9.81}, w + 0.1 * noise});
    const Eigen::VectorXd speeds = squares.cwiseSqrt();
    log.rotors.push_back({t, {speeds.begin(), speeds.end()}});
  }
  return log;
}

TEST(Inspect, FindsTheUnitOfRotorSpeeds) {
  const FlightLog good = FigureOfEight();
  FlightLog bad = good;
  for (ChannelsSample& sample : bad.rotors) {
    for (double& value : sample.values) value *= 30.0 / M_PI;
  }
  Inspection inspection;
  const FlightLog repaired = Repaired(bad, &inspection);
  EXPECT_THAT(Harmful(inspection), Contains("rotor_unit of rotors"));
  EXPECT_NEAR(repaired.rotors[100].values[0], good.rotors[100].values[0], 1e-3);
  bad = good;
  for (Rotor& rotor : bad.vehicle->rotors) rotor.k_f *= 5.0;
  EXPECT_THAT(Harmful(Inspect(bad, {})), Contains("rotor_thrust of rotors"));
}

// The change of a log, and what is harmful in it then.
struct Judged {
  const char* name;
  FlightLog (*log)();
  Change change;
  testing::Matcher<const std::vector<std::string>&> harmful;
  void (*beside)(const Inspection&) = [](const Inspection&) {};
};

void NoRepair(const Inspection& inspection) { EXPECT_TRUE(inspection.repairs.IsNone()); }

FlightLog Good() { return GoodLog(); }
FlightLog GoodWithoutMocap() {
  FlightLog log = GoodLog();
  log.mocap.clear();
  return log;
}
FlightLog FastWithoutMocap() {
  FlightLog log = testing_simulation::LogOf("fast", 0.0, 1);
  log.mocap.clear();
  return log;
}
FlightLog OfSixGates() { return testing_simulation::LogOf("fast", 60.0, 5); }

void MoveGate(FlightLog* log) {
  const int gate = log->fixes.front().gate;
  for (Fix& fix : log->fixes) {
    if (fix.gate == gate) fix.p_E += Eigen::Vector3d(0.6, -0.5, 0.0);
  }
}

void ScaleTilt(AttitudeSample& s) {
  const Eigen::Vector3d down = s.q_Ep_I * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(down);
  if (axis.norm() >= 1e-9)
    s.q_Ep_I = Turn(0.25 * std::atan2(axis.norm(), down.z()), axis) * s.q_Ep_I;
}

void JumpAfter20s(FlightLog* log) {
  const TimeNs at = log->imu.front().t + FromSeconds(20.0);
  const auto jump = [at](auto& sample) { sample.t += sample.t > at ? FromSeconds(5.0) : 0; };
  EachImu(jump)(log);
  EachAttitude(jump)(log);
}

void TurnSpins(FlightLog* log) {
  for (Rotor& rotor : log->vehicle->rotors) rotor.spin = -rotor.spin;
}

const Judged kJudged[] = {
    {"AGoodLog", Good, [](FlightLog*) {}, IsEmpty(), NoRepair},
    // A bias and a tilt of the IMU turn with the vehicle as the acceleration of its laps does.
    {"ABodyBiasIsNoScaleOfDistances", Good,
     Accel([](auto& a) { a += Eigen::Vector3d(0.15, -0.3, 0.1); }),
     Not(Contains("position_scale of mocap"))},
    // Only the accelerometer is wrong where attitude, gyroscope and positions agree.
    {"TheAccelerometerAlone", Good, Accel([](auto& a) { a = kUp * a; }),
     Each("accelerometer_axes of imu")},
    {"TheAccelerometerAloneWithoutMocap", GoodWithoutMocap, Accel([](auto& a) { a = kUp * a; }),
     Each("accelerometer_axes of imu")},
    // A gate that stands off the map is no clock, no axes and no scale.
    {"AMovedGate", OfSixGates, MoveGate, IsEmpty()},
    // Of two attitudes and a gyroscope the one that is alone is wrong.
    {"AnAttitudeThatScalesItsTiltIsNoGyroscope", Good, EachAttitude(ScaleTilt),
     Not(Contains("gyro_scale of imu"))},
    {"AClockThatJumpsIsNoGap", Good, JumpAfter20s,
     AllOf(Contains("clock_jump of imu"), Not(Contains("gaps of imu")))},
    {"TheUnitOfStamps", Good, EachImu([](ImuSample& s) { s.t *= 1000; }),
     AllOf(Contains("time_unit of imu"), Not(Contains("cover of attitude")))},
    // A filter that knows no drag tilts the force as a wrong scale does.
    {"NoAxisByTheAttitudeOfAnAhrs", GoodWithoutMocap, Accel([](auto& a) { a.y() *= 2.0; }),
     Not(Contains("lateral_force of imu"))},
    // Flat laps do not show the sign of one axis; gravity does.
    {"GravityWhereTheHandednessIsNotShown", Good, EachImu([](ImuSample& s) {
       std::swap(s.accel.x(), s.accel.y());
       std::swap(s.gyro.x(), s.gyro.y());
     }),
     ElementsAre("imu_axes of imu")},
    {"RotorsThatAreLate", FigureOfEight,
     EachRotors([](ChannelsSample& s) { s.t += FromSeconds(0.4); }),
     Contains("clock_offset of rotors")},
    // The factor of the unit is exact; what was measured holds a bias.
    {"AKnownUnitByItsFactor", Good, Accel([](auto& a) { a /= 9.80665; }),
     ElementsAre("accelerometer_scale of imu"),
     [](const Inspection& i) {
       EXPECT_DOUBLE_EQ(i.repairs.streams.at("imu").accel_scale, 9.80665);
     }},
    // Half a lap looks like a turn of the axes, where only the clock is wrong.
    {"FixesInMocapByTheirClock", Good, EachFix([](Fix& fix) { fix.t += FromSeconds(3.0); }),
     ElementsAre("clock_offset of fixes"),
     [](const Inspection& i) {
       EXPECT_NEAR(i.repairs.streams.at("fixes").time_offset, -3.0, 0.1);
     }},
    {"TheHandednessOfFixesByTheirPlaces", Good,
     EachFix([](Fix& fix) { std::swap(fix.p_E.x(), fix.p_E.y()); }),
     ElementsAre("position_axes of fixes"),
     [](const Inspection& i) {
       EXPECT_TRUE(i.repairs.streams.at("fixes").position.isApprox(kSwap));
     }},
    // Without mocap a reversed axis and a turned attitude look alike.
    {"NoTurnOfAnAttitudeForTheAccelerometer", GoodWithoutMocap, Accel([](auto& a) { a.x() *= -1; }),
     testing::_, NoRepair},
    // From the fixes alone, as from mocap, on a course that turns both ways. Calibration would find
    // neither heading nor drag.
    {"TheHeadingOfFixes", FastWithoutMocap, TurnedHeading(-0.4),
     Contains("heading_offset of attitude"),
     [](const Inspection& i) {  // with that of the AHRS
       const Eigen::Matrix3d& repair = i.repairs.streams.at("attitude").earth;
       EXPECT_NEAR(std::atan2(repair(1, 0), repair(0, 0)), 0.4, 0.1);
     }},
    // Drag would be read from it twice as large.
    {"AnAxisThatReadsTwiceTheForce", Good, Accel([](auto& a) { a.y() *= 2.0; }),
     Contains("lateral_force of imu"),
     [](const Inspection& i) {
       EXPECT_NEAR(i.findings.front().size, 0.5, 0.05);
       NoRepair(i);
     }},
    {"NothingIsComparedWithASlowImu", Good, [](FlightLog* log) { ThinImu(40, log); }, testing::_,
     [](const Inspection& i) {
       EXPECT_THAT(i.comparisons, IsEmpty());
       EXPECT_THAT(i.notes, Contains(HasSubstr("too few to compare")));
     }},
    // Days, as a spreadsheet counts them, read as seconds.
    {"AnImuFasterThanAnySensorHasAnotherUnit", Good, EachImu([](ImuSample& s) { s.t /= 86400; }),
     Contains("imu_fast of imu"),
     [](const Inspection& i) { EXPECT_THAT(i.notes, Contains(HasSubstr("too fast to compare"))); }},
    {"ARightOrderWhereSpeedsSpanLess", SixRotors, [](FlightLog*) {},
     Not(Contains(HasSubstr("rotor"))),
     [](const Inspection& inspection) {
       ASSERT_TRUE(inspection.rotors.has_value());
       for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(inspection.rotors->RightOf(i), 0);
     }},
    {"TwoOfSixChannelsExchanged", SixRotors,
     EachRotors([](ChannelsSample& s) { std::swap(s.values[0], s.values[1]); }),
     Contains("rotor_order of rotors"),
     [](const Inspection& i) {  // other orders fit alike
       EXPECT_EQ(i.repairs.streams.count("rotors"), 0U);
     }},
    {"SixSpinsTurnedRound", SixRotors, TurnSpins, Contains("rotor_spins_reversed of rotors")},
};

class InspectChange : public testing::TestWithParam<Judged> {};

TEST_P(InspectChange, IsJudged) {
  FlightLog log = GetParam().log();
  GetParam().change(&log);
  const Inspection inspection = Inspect(log, {});
  EXPECT_THAT(Harmful(inspection), GetParam().harmful);
  GetParam().beside(inspection);
}

INSTANTIATE_TEST_SUITE_P(Inspect, InspectChange, testing::ValuesIn(kJudged),
                         [](const auto& info) { return std::string(info.param.name); });

// Components in another order, read as they come: if no right repair is found none is offered.
TEST(Inspect, NoRepairLeavesGravitySideways) {
  FlightLog bad = GoodLog();
  for (AttitudeSample& s : bad.attitude) {
    const Eigen::Quaterniond flu(s.q_Ep_I.w(), s.q_Ep_I.x(), -s.q_Ep_I.y(), -s.q_Ep_I.z());
    const Eigen::Quaterniond read(flu.x(), flu.y(), flu.z(), flu.w());
    s.q_Ep_I = {read.w(), read.x(), -read.y(), -read.z()};
  }
  Inspection inspection;
  const Inspection again = Inspect(Repaired(bad, &inspection), {});
  const auto sideways = Contains("gravity_direction of attitude");
  const auto repairs = inspection.repairs.streams;
  EXPECT_THAT(Harmful(inspection), Not(IsEmpty()));
  if (repairs.count("attitude") + repairs.count("imu") > 0) {
    EXPECT_THAT(Harmful(again), Not(sideways));
  } else {
    EXPECT_THAT(Harmful(inspection), sideways);
  }
}

}  // namespace
}  // namespace trueline
