// The open catalogue: what its grammar makes, and forces without a name that it finds.
#include "problems/diagnosis/open_term.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "problems/calibration/rotor_calibration.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/rotor_flight.h"
#include "tests/rotor/rotor_flight_fixture.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

using testing::HasSubstr;

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

TEST(OpenTerms, AreDistinctAndSuitTheDrive) {
  for (const DriveKind drive : {DriveKind::kImu, DriveKind::kRotors}) {
    std::set<std::string> names;
    int moments = 0;
    for (const OpenTerm& term : OpenTerms(drive, SquareFlight())) {
      EXPECT_TRUE(names.insert(term.Name()).second) << term.Name();
      moments += term.on == TermOn::kTurn;
    }
    EXPECT_GT(names.size(), 300u);
    EXPECT_EQ(moments > 0, drive == DriveKind::kRotors);
  }
}

TEST(OpenTerms, HumpsLieWhereTheFlightHasBeen) {
  int humps = 0;
  for (const TermVariable& variable : TermVariables(SquareFlight())) {
    if (!variable.local) continue;
    ++humps;
    double most = 0.0;
    for (const TermMotion& at : SquareFlight()) most = std::max(most, variable.value(at));
    EXPECT_GT(most, 0.3) << variable.name;
  }
  EXPECT_GT(humps, 10);
}

TEST(OpenTerm, SaysWhatItIsInWords) {
  for (const OpenTerm& term : OpenTerms(DriveKind::kImu, SquareFlight())) {
    if (term.Name() != "force along x_B with pitch rate") continue;
    EXPECT_EQ(term.Text(-0.31, 0.042),
              "a force along x_B of -0.31 +- 0.042 m/s^2 for each rad/s of pitch rate");
    EXPECT_THAT(term.Physics(), HasSubstr("rotors' drag"));
    TermMotion at;
    at.w_B.y() = 2.0;
    EXPECT_EQ(term.At(at), Eigen::Vector3d(2.0, 0.0, 0.0));
    return;
  }
  ADD_FAILURE() << "no such term";
}

TEST(OpenTerm, AxesOfTheEarthTurnWithTheVehicle) {
  TermMotion at;
  at.R_E_B = Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const OpenTerm east{
      TermOn::kForce, kEast, {"one", "1", 1, [](const TermMotion&) { return 1.0; }}};
  EXPECT_LT((east.At(at) - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

FlightLog FlyWithForces(const std::vector<simulation::UnnamedForce>& forces, std::uint64_t seed) {
  SimulationConfig config = testing_simulation::ReadShipped("fast");
  config.forces = forces;
  return testing_simulation::Fly(config, seed).log;
}

Diagnosis DiagnoseQuickly(const std::vector<FlightLog>& logs) {
  ImuDiagnosisOptions options;
  options.measure_gain = false;
  return Diagnose(logs, options);
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
      DiagnoseQuickly({FlyWithForces({force}, 5), FlyWithForces({force}, 6)});
  ASSERT_FALSE(diagnosis.open.described.empty());
  const DescribedTerm& term = diagnosis.open.described[0];
  EXPECT_EQ(term.term.Name(), "force along x_B with yaw rate");
  EXPECT_NEAR(term.size.value, 0.3, 0.06);
  EXPECT_LT(term.size.sigma, 0.04);
  ASSERT_EQ(term.repeats.size(), 1u);
  EXPECT_TRUE(term.repeats[0].repeats);
  EXPECT_EQ(diagnosis.verdict, "unexplained");
}

// Large, because the flight passes the place five times only.
TEST(DiagnoseOpenTerms, SlowAPushAtAPlaceIsDescribedWhereItIs) {
  simulation::UnnamedForce push = WithMotion(kEast, {}, 2.5);
  push.place = {12.0, 31.0};
  push.radius = 6.0;
  const Diagnosis diagnosis = DiagnoseQuickly({FlyWithForces({push}, 5)});
  ASSERT_FALSE(diagnosis.open.described.empty());
  const DescribedTerm& term = diagnosis.open.described[0];
  EXPECT_TRUE(term.term.with.local) << term.term.Name();
  EXPECT_EQ(term.term.Along(), "east");
  TermMotion there, elsewhere;
  there.p_E = {12.0, 31.0, 0.0};
  elsewhere.p_E = {35.0, 10.0, 0.0};
  EXPECT_GT(term.size.value * term.term.with.value(there), 0.3);
  EXPECT_LT(term.term.with.value(elsewhere), 0.05);
}

TEST(DiagnoseOpenTerms, SlowFlightsWithoutForcesHaveNone) {
  for (const std::uint64_t seed : {5u, 6u, 7u}) {
    EXPECT_TRUE(DiagnoseQuickly({FlyWithForces({}, seed)}).open.described.empty()) << seed;
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
