// trueline-audit by flights: errors put into right files are named, with their size, and nothing
// else is; a right file is left alone. Flights are those of the simulator library.
#include "problems/simulators/audit.h"

#include <regex>
#include <set>

#include "problems/simulators/export_vehicle.h"
#include "problems/simulators/flight_estimate.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"
#include "tests/simulators/shaky_flight.h"

namespace trueline {
namespace {

constexpr double kLag = 0.04, kFullSpeed = 2200.0;  // s, rad/s
constexpr double kDrag = -0.3;                      // 1/s
constexpr const char* kDrags[] = {"K_x", "K_y", "K_z"};

// The vehicle that flies, with what a simulator's file states of it.
NeutralVehicle Truth() {
  NeutralVehicle v = MadeQuadrotor();
  v.body["tau"] = kLag, v.body["full_speed"] = kFullSpeed;
  for (const char* name : kDrags) v.body[name] = kDrag;
  return v;
}

FlightLog Fly(std::uint64_t seed, double lag = kLag, const NeutralVehicle& vehicle = Truth()) {
  RotorSimulation simulation(RotorVehicleOf(vehicle));
  simulation.noise.accel = 0.25, simulation.noise.gyro = 0.0125;
  simulation.noise.position = 0.003, simulation.noise.attitude = 0.005;
  simulation.noise.force_density = 0.05, simulation.noise.angular_density = 0.2;
  simulation.imu_rate = 100.0, simulation.pose_rate = 50.0;
  for (int i = 0; i < 3; ++i) simulation.drag[i] = vehicle.Get(kDrags[i]);
  simulation.motor_lag = lag;
  simulation::MotorDriveConfig& motors = simulation.motors.emplace();
  motors.full_speed = vehicle.Get("full_speed"), motors.idle = 0.15, motors.voltage = 0.0;
  FlightLog log = SimulateRotorFlight(simulation, RandomPath(20.0, seed), seed);
  log.directory = "flight";
  return log;
}
const FlightLog& Flight() {
  static const FlightLog log = Fly(3);
  return log;
}

class AuditTest : public MadeFile {
 protected:
  std::string Right(const std::string& to) { return Export(Truth(), to); }
  Audit Of(const std::string& text, const FlightLog& log = Flight()) const {
    return AuditByFlights(Files(text), {log});
  }
  // Named first, its size within two sigma (or the tolerance), and no parameter but `beside`.
  static void ExpectNamed(const Audit& audit, const std::string& name, double truth,
                          const std::set<std::string>& beside = {}) {
    ASSERT_FALSE(audit.contradicted.empty()) << AuditTable(audit);
    const Contradicted& first = audit.contradicted.front();
    EXPECT_EQ(first.parameter, name) << AuditTable(audit);
    ASSERT_TRUE(first.flight_value);
    EXPECT_NEAR(*first.flight_value, truth, std::max(2.0 * first.sigma, 0.01 * std::abs(truth)));
    for (const Contradicted& entry : audit.contradicted) {
      EXPECT_TRUE(entry.parameter == name || beside.contains(entry.parameter)) << AuditTable(audit);
    }
  }
  // Of drag alone, as it is.
  static void ExpectDrag(const Audit& audit, double tolerance = 0.0) {
    EXPECT_FALSE(audit.contradicted.empty());
    for (const Contradicted& entry : audit.contradicted) {
      EXPECT_THAT(entry.parameter, HasSubstr("K_")) << AuditTable(audit);
      EXPECT_NEAR(*entry.flight_value, kDrag, std::max(2.0 * entry.sigma, tolerance));
    }
  }
};

// The log of a vehicle whose rotors are not stated.
FlightLog FlightWithoutRotors() {
  FlightLog log = Flight();
  log.vehicle->rotors.clear();
  return log;
}

TEST_F(AuditTest, SlowIsSilentOnRightFiles) {
  for (const char* target : {"rotorpy", "crazyflow"}) {
    const std::string right = Right(target);
    const Audit audit = Of(right);
    EXPECT_TRUE(audit.contradicted.empty()) << target << "\n" << AuditTable(audit);
    ASSERT_EQ(audit.corrected.size(), 1U);
    EXPECT_EQ(audit.corrected[0].second, right) << "the file stays as it is, byte for byte";
    ASSERT_TRUE(audit.before && audit.after);
    EXPECT_LT((*audit.before)[1], 0.1);
  }
}

TEST_F(AuditTest, SlowNamesALagThatIsTooShort) {
  const std::string wrong = Replaced(Right("rotorpy"), "tau_m: 0.04 ", "tau_m: 0.005 ");
  const Audit audit = Of(wrong);
  ExpectNamed(audit, "tau", kLag);
  EXPECT_GT(audit.contradicted[0].line, 0);
  // Comments and all other numbers are left.
  const std::string& corrected = audit.corrected[0].second;
  const std::size_t at = wrong.find("0.005"), rest = wrong.size() - at - 5;
  EXPECT_EQ(corrected.substr(0, at), wrong.substr(0, at));
  EXPECT_EQ(corrected.substr(corrected.size() - rest), wrong.substr(wrong.size() - rest));
}

TEST_F(AuditTest, SlowNamesInertia) {
  // The Iris' old inertia, in proportion: too large in pitch and yaw, impossible together.
  const std::string right = Right("px4_sih");
  const Audit audit = Of(Replaced(Replaced(right, "SIH_IYY 0.000678", "SIH_IYY 0.00105"),
                                  "SIH_IZZ 0.001076", "SIH_IZZ 0.0019"));
  ExpectNamed(audit, "I_y", 0.678e-3, {"I_z"});
  EXPECT_THAT(Names(audit), Contains("I_z"));
}

TEST_F(AuditTest, SlowNamesTheMomentConstant) {
  const Audit audit = Of(Replaced(Right("gz"), "<momentConstant>0.00949881921</momentConstant>",
                                  "<momentConstant>0.0253</momentConstant>"));
  ExpectNamed(audit, "k_m/k_f", 3.62e-9 / 3.811e-7);
  EXPECT_LT((*audit.after)[2], (*audit.before)[2]);
}

TEST_F(AuditTest, SlowNamesRotorDragOfAnotherVehicle) {
  const std::string right = Right("gz");
  const std::string key = "<rotorDragCoefficient>";
  const std::size_t at = right.find(key) + key.size();
  const std::string number = right.substr(at, right.find('<', at) - at);
  const Audit audit = Of(Replaced(right, number, fmt::format("{:.6g}", 76.0 * std::stod(number))));
  ExpectDrag(audit, 0.03);
}

TEST_F(AuditTest, SlowNamesMassByThatOfTheLog) {
  const Audit audit = Of(Replaced(Right("rotorpy"), "mass: 0.2463", "mass: 2.463"));
  ExpectNamed(audit, "m", 0.2463);
  EXPECT_THAT(audit.contradicted[0].text, HasSubstr("power of ten"));
}

// A log that states no rotors: the flight yaws against the file's spins.
TEST_F(AuditTest, SlowNamesSpinsByTheFlight) {
  NeutralVehicle other = Truth();
  for (Numbers& rotor : other.rotors) rotor["spin"] *= -1.0;
  const std::string wrong = Export(other, "rotorpy");
  const FlightLog log = FlightWithoutRotors();
  const Audit audit = Of(wrong, log);
  EXPECT_THAT(Names(audit), ElementsAre("spin")) << AuditTable(audit);
}

// Commands, too, tell which rotor a column is, and say so only where roll and pitch show it.
TEST_F(AuditTest, OrdersRotorsByCommands) {
  FlightLog log = Flight();
  log.rotors.clear();
  const std::vector<int> columns = {3, 0, 1, 2};
  NeutralVehicle file = Truth();
  EXPECT_EQ(OrderByFlight(log, file).rotors, (std::vector<int>{0, 1, 2, 3}));
  for (std::size_t i = 0; i < 4; ++i) {
    file.rotors[static_cast<std::size_t>(columns[i])] = Truth().rotors[i];
  }
  const RotorOrder order = OrderByFlight(log, file);
  EXPECT_EQ(order.rotors, columns);
  EXPECT_TRUE(order.shown);
  for (ChannelsSample& sample : log.motors) sample.values.assign(4, 0.5);
  EXPECT_FALSE(OrderByFlight(log, file).shown);
}

// A converter turned the accelerometer into the body by the attitude of another moment, by which
// the gyroscope is late, too. Thrust by rates looks like drag, and inertia too large.
TEST_F(AuditTest, SlowReadsDragBesideStreamsOfOtherMoments) {
  constexpr double kLate = 0.03;  // s
  FlightLog log = Flight();
  for (ImuSample& sample : log.imu) sample.accel += kLate * sample.gyro.cross(sample.accel);
  for (std::size_t i = log.imu.size() - 1; i > 0; --i) {
    const TimeNs then = log.imu[i].t - FromSeconds(kLate);
    const auto at = std::ranges::upper_bound(log.imu, then, {}, &ImuSample::t);
    log.imu[i].gyro = at->gyro;
  }
  const std::string right = Right("crazyflow");
  const Audit silent = Of(right, log);
  EXPECT_TRUE(silent.contradicted.empty()) << AuditTable(silent);
  const Audit audit = Of(std::regex_replace(right, std::regex("-(0\\.0738\\d*)"), "$1"), log);
  ExpectDrag(audit);
}

// Rotors whose drag acts far above the centre of mass turn the vehicle more than it turns.
TEST_F(AuditTest, SlowNamesTheHeightOfTheCentreOfMass) {
  NeutralVehicle truth = Truth();
  truth.body["r_BM_z"] = 0.005;
  const Target& gz = FindTarget("gz");
  truth.gravity = gz.gravity;
  Export(truth, "gz");
  const NeutralVehicle right = ExportVehicle(truth, gz).vehicle;
  const FlightLog log = LogOf(
      replay::FlyWith(replay::LoadGazebo(path_, false), {}, ShakyPilot(right, 1), 25.0), right, 1);
  const Audit silent = AuditByFlights(ReadVehicleFiles({path_.string()}), {log});
  EXPECT_TRUE(silent.contradicted.empty()) << AuditTable(silent);
  // The file's drag goes with rotor speeds, which in this flight are not those of hover.
  const auto drag = std::ranges::find(silent.compared, "K_x", &Compared::parameter);
  EXPECT_NEAR(drag->file_value, drag->flight_value, 2.5 * drag->sigma);
  truth.body["r_BM_z"] = 0.03;
  Export(truth, "gz");
  const Audit audit = AuditByFlights(ReadVehicleFiles({path_.string()}), {log});
  ASSERT_EQ(audit.contradicted.size(), 1U) << AuditTable(audit);
  EXPECT_EQ(audit.contradicted[0].parameter, "r_BM_z");
  EXPECT_NEAR(*audit.contradicted[0].flight_value, 0.005, 0.003);
}

// An I_z that no body has beside what the flight shows does not hold I_x and I_y away from it, and
// none of them stands beside what the file's own impossible inertia says.
TEST_F(AuditTest, SlowNamesInertiaThatIsHeldAway) {
  const std::string right = Right("rotorpy");
  const Audit audit = Of(Replaced(
      Replaced(Replaced(right, "Ixx: 0.000623", "Ixx: 0.00099"), "Iyy: 0.000678", "Iyy: 0.00108"),
      "Izz: 0.001076", "Izz: 0.00198"));
  std::map<std::string, double> named;
  for (const Contradicted& entry : audit.contradicted) named[entry.parameter] = *entry.flight_value;
  ASSERT_EQ(named.size(), 3U) << AuditTable(audit);
  EXPECT_NEAR(named["I_x"] / 0.623e-3, 1.0, 0.03);
  EXPECT_NEAR(named["I_y"] / 0.678e-3, 1.0, 0.03);
  EXPECT_NEAR(named["I_z"] / 1.076e-3, 1.0, 0.1);
}

// What vehicles of one kind differ by is no error, but what it costs is said.
TEST_F(AuditTest, SlowSaysWhatADifferenceWithinTheScatterCosts) {
  NeutralVehicle vehicle = Truth();
  vehicle.body["r_BM_x"] = 0.003;
  const Audit audit = Of(Right("rotorpy"), Fly(3, kLag, vehicle));
  EXPECT_TRUE(audit.contradicted.empty()) << AuditTable(audit);
  const auto of = [&](const char* name) {
    return *std::ranges::find(audit.compared, name, &Compared::parameter);
  };
  EXPECT_TRUE(of("r_BM_x").cost) << AuditTable(audit);
  EXPECT_FALSE(of("r_BM_y").cost);
  EXPECT_THAT(AuditTable(audit), HasSubstr("differs:      r_BM_x"));
}

// A flight shows the arm over the inertia. Where yaw is right, one number explains both moments.
TEST_F(AuditTest, SlowNamesTheArmThatExplainsBothMoments) {
  NeutralVehicle other = Truth();
  for (Numbers& rotor : other.rotors) rotor["x"] *= std::sqrt(2.0), rotor["y"] *= std::sqrt(2.0);
  const std::string wrong = Export(other, "rotorpy");
  const FlightLog log = FlightWithoutRotors();
  const Audit audit = Of(wrong, log);
  ExpectNamed(audit, "arm", Truth().Get("arm"));
  EXPECT_THAT(audit.contradicted[0].confused_with, Contains("I_x"));
  EXPECT_LT((*audit.after)[1], (*audit.before)[1]);
  EXPECT_EQ(Of(wrong).contradicted.front().parameter, "arm");
  // An arm makes no yaw wrong.
  other = Truth();
  for (const char* name : {"I_x", "I_y", "I_z"}) other.body[name] *= 2.0;
  EXPECT_THAT(Names(Of(Export(other, "rotorpy"), log)), UnorderedElementsAre("I_x", "I_y", "I_z"));
}

// A flight shows thrust and inertia by mass. Where nobody has weighed the vehicle, one number
// explains them.
TEST_F(AuditTest, SlowNamesAMassThatNobodyHasWeighed) {
  const std::string right = Right("rotorpy");
  FlightLog log = Flight();
  log.vehicle->mass.reset();
  const Audit audit = Of(Replaced(right, "mass: 0.2463", "mass: 0.2956"), log);
  ExpectNamed(audit, "m", 0.2463);
  EXPECT_THAT(audit.contradicted[0].confused_with, Contains("k_f"));
  EXPECT_TRUE(Of(right, log).contradicted.empty());
}

// Commands that never come near full do not show the speed there; a clip of a simulator is no
// slope of the log's commands.
TEST_F(AuditTest, SlowLeavesAFullSpeedThatIsNotFlownUndecided) {
  const std::string right = Right("crazyflow");
  FlightLog log = Flight();
  for (ChannelsSample& sample : log.motors) {
    for (double& u : sample.values) u *= 0.7;
  }
  const Audit audit = Of(right, log);
  EXPECT_TRUE(audit.contradicted.empty()) << AuditTable(audit);
  EXPECT_THAT(AuditTable(audit), HasSubstr("undecided:    full_speed"));
}

// Thrust by a polynomial is read at the speeds that were flown, whatever hover the file's mass
// makes. By the first power of the speed alone it is no propeller's.
TEST_F(AuditTest, SlowReadsAPolynomialAtTheSpeedsOfTheFlight) {
  const double k = Truth().Get("k_f") / 91.189, w = Truth().Get("w_h") * 9.5493;
  const std::regex curve("(rpm2thrust = \\[0\\.0, )[^\\]]*");
  const std::string right = Right("crazyflow"),
                    bent = fmt::format("$1 {}, {}", -0.5 * k * w, 1.5 * k);
  const Audit audit = Of(std::regex_replace(std::regex_replace(right, curve, bent),
                                            std::regex("mass = [0-9.]*"), "mass = 2.463"));
  ExpectNamed(audit, "m", 0.2463);
  const Audit linear = Of(std::regex_replace(right, curve, fmt::format("$1 {}, 1e-15", k * w)));
  ASSERT_FALSE(linear.contradicted.empty());
  EXPECT_EQ(linear.contradicted[0].parameter, "k_f_1") << AuditTable(linear);
}

// Quadratic drag is compared, and corrected, as it acts at the flight's speed.
TEST_F(AuditTest, SlowNamesQuadraticDrag) {
  NeutralVehicle other = Truth();
  for (const char axis : {'x', 'y', 'z'}) {
    other.body.erase(std::string("K_") + axis), other.body[std::string("c_") + axis] = 1.5;
  }
  const std::string wrong = Export(other, "rotorpy");
  const Audit audit = Of(wrong);
  ExpectDrag(audit);
  EXPECT_TRUE(Of(audit.corrected[0].second).contradicted.empty());
}

// Places that count from the centre of mass move with it.
TEST_F(AuditTest, SlowMovesRotorsWithTheCentreOfMass) {
  NeutralVehicle other = Truth();
  for (Numbers& rotor : other.rotors) rotor["x"] += 0.012;
  const Audit audit = Of(Export(other, "rotorpy"));
  ExpectNamed(audit, "r_BM_x", 0.012);
  EXPECT_LT((*audit.after)[1], 0.2 * (*audit.before)[1]);
}

// Commands answer what the vehicle does; the lag is not biased by that.
TEST_F(AuditTest, SlowShowsTheLagByCommandsAlone) {
  FlightLog log = Flight();
  log.rotors.clear();
  const FlightValue lag = EstimateFromFlight(log, Truth()).values.at("tau");
  ASSERT_TRUE(lag.shown);
  EXPECT_NEAR(lag.value, kLag, 2.5 * lag.sigma);
  EXPECT_LT(lag.sigma, 0.5 * kLag);
}

// Rotors that log.yaml states in another order than the file: what is sent by number needs it.
TEST_F(AuditTest, SlowSaysThatTheLogHasAnotherOrderOfRotors) {
  NeutralVehicle other = Truth();
  std::ranges::swap(other.rotors[0], other.rotors[1]);
  std::ranges::swap(other.rotors[2], other.rotors[3]);
  const Audit audit = Of(Export(other, "rotorpy"));
  EXPECT_TRUE(audit.contradicted.empty()) << AuditTable(audit);
  EXPECT_THAT(audit.warnings, Contains(HasSubstr("are the file's rotors 1, 0, 3, 2")));
}

TEST_F(AuditTest, SlowNamesAThrustConstantInAnotherUnit) {
  const Audit audit = Of(Replaced(Right("flightmare"), "[3.811e-07,", "[3.4752e-05,"));
  ExpectNamed(audit, "k_f", 3.811e-7);
  EXPECT_THAT(audit.contradicted[0].text, HasSubstr("rpm for rad/s, squared"));
}

// The numbers of an Iris on a small vehicle: all are named, none is left to explain another.
TEST_F(AuditTest, SlowNamesAnotherVehiclesNumbers) {
  NeutralVehicle other = Truth();
  other.body["m"] *= 6.0;
  other.body["I_x"] *= 50.0, other.body["I_y"] *= 100.0, other.body["I_z"] *= 90.0;
  for (Numbers& rotor : other.rotors) rotor["k_f"] *= 22.4, rotor["k_m"] *= 37.4;
  const std::string wrong = Export(other, "flightmare");
  std::map<std::string, double> named;
  for (const Contradicted& entry : Of(wrong).contradicted) {
    ASSERT_TRUE(entry.flight_value) << entry.parameter;
    named[entry.parameter] = *entry.flight_value;
  }
  for (const auto& [name, truth] : std::map<std::string, double>{{"m", 0.2463},
                                                                 {"I_x", 0.623e-3},
                                                                 {"I_y", 0.678e-3},
                                                                 {"I_z", 1.076e-3},
                                                                 {"k_f", 3.811e-7},
                                                                 {"k_m/k_f", 9.5e-3}}) {
    ASSERT_TRUE(named.contains(name)) << name;
    EXPECT_NEAR(named[name] / truth, 1.0, 0.25) << name;
  }
}

TEST_F(AuditTest, SlowNamesTheSameByLogsAlone) {
  NeutralVehicle other = Truth();
  other.body["I_x"] *= 1.5;
  const Audit audit = AuditLogs(Fly(5, 0.005, other), {Flight()});
  EXPECT_THAT(Names(audit), UnorderedElementsAre("tau", "I_x")) << AuditTable(audit);
  EXPECT_TRUE(AuditLogs(Fly(6), {Flight()}).contradicted.empty());
}

// A heavier vehicle in the simulator: nothing follows from its mass, stated or not.
TEST_F(AuditTest, SlowNamesMassByLogsAlone) {
  NeutralVehicle other = Truth();
  other.body["m"] *= 1.2;
  FlightLog simulated = Fly(5, kLag, other);
  ExpectNamed(AuditLogs(simulated, {Flight()}), "m", 0.2463);
  simulated.vehicle->mass.reset();
  ExpectNamed(AuditLogs(simulated, {Flight()}), "m", 0.2463);
}

// Rotors of a lighter vehicle turn slower, so that their drag is another one for each kg.
TEST_F(AuditTest, SlowNamesAMassAndNotTheDragThatFollows) {
  constexpr double kLighter = 4.0;
  NeutralVehicle light = Truth();
  light.body["m"] /= kLighter;
  for (const char* name : kDrags) light.body[name] *= std::sqrt(kLighter);
  const Audit audit = AuditLogs(Fly(5, kLag, light), {Flight()});
  EXPECT_THAT(Names(audit), ElementsAre("m")) << AuditTable(audit);
}

// A number stands in one list, with what would decide it where it is undecided, and none is nan.
TEST_F(AuditTest, WritesEachNumberOnce) {
  Audit audit;
  audit.compared = {{"I_x", "kg m^2", 1.0, 2.0, 0.9, 0.1, false},
                    {"K_x", "1/s", -0.3, -0.31, 0.01, 0.1, false},
                    {"tau", "s", 0.01, 0.04, 0.001, 0.01, true}};
  audit.not_judged = {{"I_x", "roll hard"}, {"k_f", "state the mass"}};
  Contradicted lag;
  lag.parameter = "tau", lag.unit = "s", lag.file_value = 0.01, lag.flight_value = 0.04;
  lag.cost = {0.1, INFINITY, INFINITY};
  audit.contradicted = {lag};
  audit.before = {0.1, INFINITY, NAN}, audit.after = audit.best = {0.1, 0.2, NAN};
  const std::string table = AuditTable(audit);
  EXPECT_THAT(table, HasSubstr("undecided:    I_x"));
  EXPECT_THAT(table, HasSubstr("; roll hard\n"));
  EXPECT_THAT(table, HasSubstr("agrees:       K_x"));
  EXPECT_THAT(table, HasSubstr("not judged:   k_f"));
  EXPECT_THAT(table, HasSubstr("0.50 s: diverges with the file, 0.200 m corrected"));
  for (const char* name : {"I_x", "K_x", "tau", "k_f"}) {
    EXPECT_EQ(table.find(name), table.rfind(name)) << table;
  }
  WriteAudit(audit, folder_.directory());
  const std::string yaml = ReadText(folder_ / "audit.yaml");
  for (const char* none : {"nan", "inf"}) {
    EXPECT_EQ(table.find(none), std::string::npos) << table;
    EXPECT_EQ(yaml.find(none), std::string::npos) << yaml;
  }
}

// A log that states no rotors and hovers shows no order of its columns; advice leaves out what the
// log has.
TEST_F(AuditTest, SlowSaysThatNothingShowsTheOrderOfRotors) {
  FlightLog log = Fly(4);
  log.vehicle->rotors.clear();
  for (ChannelsSample& sample : log.rotors) {
    std::ranges::fill(sample.values, sample.values.front());
  }
  const Audit audit = Of(Right("rotorpy"), log);
  EXPECT_THAT(audit.warnings, Contains(HasSubstr("does not show which rotor a column is")));
  for (const NotJudged& n : audit.not_judged) {
    EXPECT_THAT(n.fly, Not(HasSubstr("log measured rotor speeds"))) << n.parameter;
  }
}

TEST_F(AuditTest, SaysWhatALogLacks) {
  FlightLog log = Flight();
  log.rotors.clear(), log.motors.clear();
  const std::string right = Right("rotorpy");
  EXPECT_THAT(ErrorOf([&] { Of(right, log); }), HasSubstr("rotors.csv"));
  log = Flight();
  log.pose.clear(), log.mocap.clear();
  EXPECT_THAT(ErrorOf([&] { Of(right, log); }), HasSubstr("poses"));
}

}  // namespace
}  // namespace trueline
