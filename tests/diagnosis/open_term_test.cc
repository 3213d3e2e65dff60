// The open catalogue: what its grammar makes, and forces without a name that it finds.
#include "problems/diagnosis/open_term.h"

#include <algorithm>
#include <set>

#include "problems/calibration/calibration_config.h"
#include "problems/calibration/rotor_calibration.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/rotor_flight.h"
#include "problems/diagnosis/write_diagnosis.h"
#include "problems/log/samples.h"
#include "tests/common/test_files.h"
#include "tests/diagnosis/expect_cause.h"
#include "tests/rotor/rotor_flight_fixture.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

constexpr int kPitchRate = 4, kYawRate = 5;  // of UnnamedForce::factors
constexpr int kXB = 0, kEast = 4;            // of its axes

// Round a square of 20 m, heading along the flight.
std::vector<TermMotion> SquareFlight() {
  std::vector<TermMotion> flight;
  for (int side = 0; side < 4; ++side) {
    const double heading = 0.5 * M_PI * side;
    const Eigen::Vector3d corners[] = {{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}};
    for (int k = 0; k < 50; ++k) {
      TermMotion at;
      at.R_E_B = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      at.v_B = {5.0, 0.0, 0.0};
      at.p_E = corners[side] + 0.4 * k * at.R_E_B.col(0);
      flight.push_back(at);
    }
  }
  return flight;
}

// A log that shows turn rates, thrust and voltage.
FlightLog SquareLog() {
  FlightLog log;
  log.gravity = 9.81;
  for (int k = 0; k <= 100; ++k) {
    log.imu.push_back({FromSeconds(0.4 * k), {0.0, 0.0, -9.81}, Eigen::Vector3d::Zero()});
    log.battery.push_back({FromSeconds(0.4 * k), 15.0});
  }
  return log;
}

std::vector<TermForm> TermsOf(DriveKind drive) {
  return OpenTerms({drive, SquareLog(), SquareFlight()});
}

TEST(OpenTerms, AreDistinctAndSuitTheDrive) {
  for (const DriveKind drive : {DriveKind::kImu, DriveKind::kRotors}) {
    std::set<std::string> names;
    int moments = 0;
    for (const TermForm& term : TermsOf(drive)) {
      EXPECT_TRUE(names.insert(term.Name()).second) << term.Name();
      moments += term.on == TermOn::kTurn;
    }
    EXPECT_GT(names.size(), 300u);
    EXPECT_EQ(moments > 0, drive == DriveKind::kRotors);
  }
}

TEST(TermGroups, NameWhatAFlightOfEachDriveIsCorrelatedWith) {
  for (const DriveKind drive : {DriveKind::kImu, DriveKind::kRotors}) {
    const std::vector<TermMotion> flight = SquareFlight();
    std::set<std::string> names;
    int held = 0;
    for (const TermGroup& group : TermGroups({drive, SquareLog(), flight})) {
      EXPECT_TRUE(names.insert(group.name).second) << group.name;
      held += group.held;
      const TermColumns columns =
          TermColumnsOf(group, flight, ColumnPlaces().Next(group.terms.size()));
      EXPECT_EQ(columns.ordinary.size(), std::ssize(columns.columns)) << group.name;
      EXPECT_GT(columns.ordinary.minCoeff(), 0.0) << group.name;
    }
    EXPECT_GE(names.size(), 10u);
    EXPECT_EQ(held > 0, drive == DriveKind::kRotors);  // errors of readings are its states' own
  }
}

TEST(OpenTerms, HaveHistoryVoltageErrorsOfFixesAndSlopesOfPlaces) {
  std::set<std::string> names;
  for (const TermForm& term : TermsOf(DriveKind::kImu)) {
    names.insert(term.Where() + " " + SymbolsOf(term.with));
  }
  for (const char* name : {"force_x lag(r;0.3)", "force_y U(15)", "fix_north v_x", "fix_x sin(psi)",
                           "attitude_yaw cos(2*psi)"}) {
    EXPECT_EQ(names.count(name), 1u) << name;
  }
  const auto slope = std::find_if(names.begin(), names.end(), [](const std::string& name) {
    return name.rfind("force_east slope_north(", 0) == 0;
  });
  EXPECT_NE(slope, names.end());
  EXPECT_EQ(names.count("force_y lag(p;0.1)"), 0u) << "a controller answers gusts this way";
  EXPECT_EQ(names.count("force_north lag(q;1)"), 0u) << "the same at one heading";
}

TEST(OpenTerms, AVehicleThatHoversTurnsForGustsAlone) {
  std::vector<TermMotion> slow = SquareFlight();
  for (TermMotion& motion : slow) motion.v_B *= 0.1;
  const auto count = [](const std::vector<TermMotion>& flight, const std::string& name) {
    const std::vector<TermForm> terms = OpenTerms({DriveKind::kImu, SquareLog(), flight});
    return std::ranges::count_if(terms, [&](const TermForm& term) {
      return term.Where() + " " + SymbolsOf(term.with) == name;
    });
  };
  for (const char* name : {"force_x q", "force_y p"}) {
    EXPECT_EQ(count(SquareFlight(), name), 1) << name;
    EXPECT_EQ(count(slow, name), 0) << name;
  }
  EXPECT_EQ(count(slow, "force_x r"), 1);
}

TEST(OpenTerms, HumpsLieWhereTheFlightHasBeen) {
  int humps = 0;
  for (const auto& variable : TermVariables({DriveKind::kImu, SquareLog(), SquareFlight()})) {
    if (variable[0].of != TermQuantity::kPlace) continue;
    ++humps;
    double most = 0.0;
    for (const TermMotion& at : SquareFlight())
      most = std::max(most, ValueOf<double>(variable, at));
    EXPECT_GT(most, 0.3) << WordsOf(variable);
  }
  EXPECT_GT(humps, 10);
}

TEST(OpenTerms, HumpsAreRefinedByMovingAndWidening) {
  const std::vector<TermMotion> flight = SquareFlight();
  const Eigen::Vector3d at = flight[flight.size() / 3].p_E;
  TermForm hump = ParseTerm("force_east", "place(8,2;2.5)");
  hump.with[0].at = {at.x(), at.y(), 2.5};
  const std::vector<TermForm> nearby = NearbyHumps(hump, flight, 0.5);
  EXPECT_GE(nearby.size(), 10u);
  EXPECT_EQ(SymbolsOf(nearby[0].with), SymbolsOf(hump.with));
  for (const TermForm& moved : nearby) {
    EXPECT_EQ(SymbolsOf(ParseTerm(moved.Where(), SymbolsOf(moved.with)).with),
              SymbolsOf(moved.with));
  }
  // No further than the flight has been: a force there has any size.
  hump.with[0].at = {at.x() + 1e3, at.y(), 2.5};
  EXPECT_EQ(NearbyHumps(hump, flight, 0.5).size(), 1u);
}

TEST(OpenTerms, ASlopeTellsOfAHumpOnEitherSide) {
  const auto sides = HumpsToldBy(ParseTerm("force_east", "slope_north(8,2;2)"));
  ASSERT_EQ(sides.size(), 2u);
  EXPECT_NEAR(sides[0].with[0].at[0], 6.6, 1e-9);
  EXPECT_NEAR(sides[1].with[0].at[0], 9.4, 1e-9);
  EXPECT_EQ(HumpsToldBy(ParseTerm("force_east", "place(8,2;2)")).size(), 1u);
  EXPECT_TRUE(HumpsToldBy(ParseTerm("force_east", "v_x")).empty());
}

TEST(OpenTerms, NoFixesDriftEvenly) {
  for (const TermForm& term : OpenTerms({DriveKind::kImu, SquareLog(), SquareFlight()})) {
    EXPECT_FALSE(term.on == TermOn::kFix && term.with[0].of == TermQuantity::kTime) << term.Name();
  }
}

TEST(OpenTerms, KnowThePhysicsOfSomeForms) {
  EXPECT_THAT(PhysicsOf(ParseTerm("force_x", "q")), HasSubstr("rotors' drag"));
  EXPECT_THAT(PhysicsOf(ParseTerm("force_east", "place(8,2;2)")), HasSubstr("moving air"));
  EXPECT_EQ(PhysicsOf(ParseTerm("force_x", "q*r")), "");
}

TEST(OpenTerms, AxesOfTheEarthTurnWithTheVehicle) {
  TermMotion at;
  at.R_E_B = Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  at.v_B.x() = 2.0;
  const TermForm east = ParseTerm("force_east", "v_x");
  EXPECT_LT((east.At(at) - 2.0 * Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

FlightLog FlyWithForces(const std::vector<simulation::UnnamedForce>& forces, std::uint64_t seed) {
  SimulationConfig config = testing_simulation::ReadShipped("fast");
  config.forces = forces;
  return testing_simulation::Fly(config, seed).log;
}

simulation::UnnamedForce WithMotion(int axis, const std::vector<int>& factors, double size) {
  simulation::UnnamedForce force;
  force.axis = axis;
  force.factors = factors;
  force.size = size;
  return force;
}

TEST(DiagnoseOpenTerms, SlowAForceThatGoesWithTheTurnIsDescribedAndRepeats) {
  const auto force = WithMotion(kXB, {kYawRate}, 0.3);
  const Diagnosis diagnosis =
      testing_diagnosis::DiagnoseQuickly({FlyWithForces({force}, 5), FlyWithForces({force}, 6)});
  ASSERT_FALSE(diagnosis.open.described.empty());
  const DescribedTerm& term = diagnosis.open.described[0];
  EXPECT_EQ(term.term.Name(), "force along x_B with yaw rate");
  EXPECT_NEAR(term.size.value, 0.3, 0.06);
  EXPECT_LT(term.size.sigma, 0.04);
  ASSERT_EQ(term.repeats.size(), 1u);
  EXPECT_EQ(term.repeats[0].outcome, "repeats");
  EXPECT_EQ(diagnosis.verdict, "explained");
}

auto CountOf(const TermForm& term, const OpenCatalogue& open) {
  return std::count_if(open.described.begin(), open.described.end(),
                       [&](const DescribedTerm& d) { return d.term.Name() == term.Name(); });
}

// model.yaml of one flight serves the next one: the term is part of the model there, and is not
// found a second time.
TEST(DiagnoseOpenTerms, SlowATermJoinsTheModelOfTheNextFlight) {
  const auto force = WithMotion(kXB, {kYawRate}, 0.6);
  const Diagnosis first = Diagnose({FlyWithForces({force}, 5)}, ImuDiagnosisOptions());
  ASSERT_EQ(first.in_model.size(), 1u);
  const Effect& term = first.in_model[0];
  EXPECT_EQ(term.term->Name(), "force along x_B with yaw rate");
  EXPECT_NEAR(term["size"], 0.6, 3.0 * term["sigma"]);
  EXPECT_LT(term["sigma"], 0.12);
  EXPECT_GT(first.terms_gains.replays.low, 0.0);
  EXPECT_LT(first.terms_gains.replays.after, 0.85 * first.terms_gains.replays.before);

  const TestFolder folder;
  WriteDiagnosis(first, DiagnosisNode(first, YAML::Node()), folder / "result");
  const CalibrationOptions model =
      ResolveCalibrationOptions({"", (folder / "result/model.yaml").string(), "vgd", "", "", 0});
  ImuDiagnosisOptions with;
  with.vgd = model.methods.vgd;
  with.effects = model.effects;
  with.measure_gain = false;
  const FlightLog next = FlyWithForces({force}, 6);
  const Diagnosis second = Diagnose({next}, with),
                  without = testing_diagnosis::DiagnoseQuickly({next});
  // At nearly one speed yaw rate and its product with the speed are alike.
  TermForm product = *term.term;
  product.with.insert(product.with.begin(), {TermQuantity::kSpeedX, {}});
  EXPECT_EQ(CountOf(*term.term, without.open) + CountOf(product, without.open), 1);
  EXPECT_EQ(CountOf(*term.term, second.open) + CountOf(product, second.open), 0);
  ASSERT_FALSE(second.in_model.empty());
  EXPECT_EQ(second.in_model[0].term->Name(), term.term->Name());
}

// Large, because the flight passes the place five times only.
TEST(DiagnoseOpenTerms, SlowAForceAtAPlaceIsDescribedWhereItIs) {
  simulation::UnnamedForce push = WithMotion(kEast, {}, 2.5);
  push.place = {12.0, 31.0};
  push.radius = 6.0;
  const Diagnosis diagnosis = testing_diagnosis::DiagnoseQuickly({FlyWithForces({push}, 5)});
  ASSERT_FALSE(diagnosis.open.described.empty());
  const DescribedTerm& term = diagnosis.open.described[0];
  EXPECT_TRUE(IsLocal(term.term.with)) << term.term.Name();
  EXPECT_EQ(term.term.Along(), "east");
  TermMotion there, elsewhere;
  there.p_E = {12.0, 31.0, 0.0};
  elsewhere.p_E = {35.0, 10.0, 0.0};
  EXPECT_GT(term.size.value * ValueOf<double>(term.term.with, there), 0.3);
  EXPECT_LT(ValueOf<double>(term.term.with, elsewhere), 0.05);
}

// A lens: vectors to gates are too long by 8 % for each metre of distance.
TEST(DiagnoseOpenTerms, SlowFixesThatErrWithTheSquareOfTheDistance) {
  FlightLog log = FlyWithForces({}, 5);
  for (Fix& fix : log.fixes) {
    const Eigen::Vector3d to_gate = GateOf(log, fix.gate)->position - fix.p_E;
    fix.p_E -= 0.08 * to_gate.norm() * to_gate;
  }
  const Diagnosis diagnosis = testing_diagnosis::DiagnoseQuickly({log});
  const auto& described = diagnosis.open.described;
  const auto term = std::ranges::find_if(
      described, [](const DescribedTerm& t) { return t.term.Where() == "fix_gate"; });
  ASSERT_NE(term, described.end());
  EXPECT_EQ(SymbolsOf(term->term.with), "d*d");
  EXPECT_NEAR(term->size.value, -0.08, 0.03);
  EXPECT_EQ(diagnosis.verdict, "unexplained");
}

TEST(DiagnoseOpenTerms, SlowFlightsWithoutForcesHaveNone) {
  for (const std::uint64_t seed : {5u, 6u, 7u}) {
    EXPECT_TRUE(
        testing_diagnosis::DiagnoseQuickly({FlyWithForces({}, seed)}).open.described.empty())
        << seed;
  }
}

TEST(DiagnoseOpenTerms, SlowRotorsShowAForceThatGoesWithARate) {
  RotorSimulation sim(WuestVehicle());
  sim.noise = {0.4, 0.03, 0.003, 0.005, 0.05, 0.3};
  sim.forces = {WithMotion(kXB, {kPitchRate}, 0.8)};
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(25.0, 5), 5);
  RotorDiagnosisOptions options{RotorCalibrationOptions(WuestVehicle())};
  options.calibration.prior = DrawnPrior(WuestVehicle(), 2);
  options.calibration.noise = sim.noise;
  options.calibration.learn_noise = false;
  options.measure_gain = false;
  const Diagnosis diagnosis = Diagnose({log}, options);
  ASSERT_FALSE(diagnosis.open.described.empty());
  const DescribedTerm& term = diagnosis.open.described[0];
  EXPECT_EQ(term.term.Name(), "force along x_B with pitch rate");
  EXPECT_NEAR(term.size.value, 0.8, 4.0 * term.size.sigma);
}

}  // namespace
}  // namespace trueline
