// Whole diagnoses of simulated rotor-driven flights, to their files.
#include "problems/calibration/calibration_config.h"
#include "problems/calibration/write_calibration.h"
#include "problems/common/error.h"
#include "problems/diagnosis/rotor_flight.h"
#include "problems/diagnosis/write_diagnosis.h"
#include "tests/common/test_files.h"
#include "tests/diagnosis/expect_cause.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline::testing_diagnosis {
namespace {

FlightLog FlyRotorsHiding(const std::vector<Effect>& effects, double duration, std::uint64_t seed) {
  RotorSimulation sim(WuestVehicle());
  sim.noise = {0.4, 0.03, 0.003, 0.005, 0.05, 0.3};
  sim.height = 1.2;
  sim.effects = effects;
  sim.log_commands = !effects.empty() && effects[0].id == "motor_lag";
  return SimulateRotorFlight(sim, RandomPath(duration, seed), seed);
}

RotorDiagnosisOptions RotorOptions(bool measure_gain = true) {
  RotorDiagnosisOptions options{RotorCalibrationOptions(WuestVehicle())};
  options.calibration.prior = DrawnPrior(WuestVehicle(), 2);
  options.calibration.noise = {0.4, 0.03, 0.003, 0.005, 0.05, 0.3};
  options.calibration.learn_noise = false;
  options.measure_gain = measure_gain;
  return options;
}

SquaredErrors ExpectOnlyCause(const Diagnosis& diagnosis, const Hidden& hidden) {
  EXPECT_EQ(diagnosis.causes.size(), 1u) << hidden.id;
  return diagnosis.causes.empty() ? SquaredErrors() : ExpectCause(diagnosis.causes[0], hidden);
}

TEST(DiagnoseRotors, ACleanFlightIsClean) {
  const Diagnosis diagnosis = Diagnose({FlyRotorsHiding({}, 10.0, 5)}, RotorOptions());
  EXPECT_EQ(diagnosis.verdict, "clean");
  EXPECT_NEAR(diagnosis.before.rms, 1.0, 0.15);
  EXPECT_EQ(diagnosis.after.rows.size(), 2 * 299u);
  std::set<std::string> ids;
  for (const CandidateReport& c : diagnosis.candidates) {
    ids.insert(c.id);
    EXPECT_GT(c.detectable.minCoeff(), 0.0) << c.label;
  }
  EXPECT_EQ(ids.size(), 13u);
}

TEST(DiagnoseRotors, AModelThatTheFlightContradictsIsNotUsed) {
  RotorDiagnosisOptions options = RotorOptions(false);
  options.calibration.prior_without_model = options.calibration.prior;
  options.calibration.prior.mean[kMassConstant] = 0.21;
  options.calibration.prior.sigma[kMassConstant] = 0.0005;
  const Diagnosis diagnosis = Diagnose({FlyRotorsHiding({}, 10.0, 5)}, options);
  EXPECT_THAT(diagnosis.warnings, ElementsAre(HasSubstr("the model's m of 0.21 +- 0.0005 kg")));
  EXPECT_EQ(diagnosis.verdict, "clean");
}

// The search's first value of a cause may be far off. A value with which the flight fits worse than
// without the cause is shortened.
TEST(RotorFit, SlowAFirstValueFarOffEndsWhereANearOneDoes) {
  const FlightLog log =
      FlyRotorsHiding({{"rotor_tilt", {{"roll", 0.03}, {"pitch", -0.02}}}}, 8.0, 6);
  const auto fitted = [&](double roll, double pitch) -> Eigen::VectorXd {
    RotorDrivenFlight flight(log, RotorOptions().calibration);
    std::vector<Found> found{{{&InfoOf("rotor_tilt"), {}}, Eigen::Vector2d(roll, pitch)}};
    flight.Fit(&found);
    return found[0].value;
  };
  const Eigen::VectorXd near = fitted(0.025, -0.025), far = fitted(-0.6, 0.5);
  EXPECT_LT((near - Eigen::Vector2d(0.03, -0.02)).norm(), 0.01);
  EXPECT_LT((far - near).norm(), 1e-3);
}

// With such a size the vehicle turns away within milliseconds, so that no weights exist. The cause
// of the fit before is gone, so that this size is not compared with an earlier one.
TEST(RotorFit, ASizeAtWhichTheModelRunsAwayIsShortened) {
  const FlightLog log = FlyRotorsHiding({}, 4.0, 6);
  RotorDrivenFlight flight(log, RotorOptions().calibration);
  std::vector<Found> tilt{{{&InfoOf("rotor_tilt"), {}}, Eigen::Vector2d(0.01, 0.01)}};
  flight.Fit(&tilt);
  const TermForm turns_on = ParseTerm("moment_x", "p");
  std::vector<Found> away{{Candidate::OfTerm(turns_on, 1.0), Eigen::VectorXd::Constant(1, 1e5)}};
  flight.Fit(&away);
  EXPECT_LT(std::abs(away[0].value[0]), 3.0);  // 1/s
  Diagnosis diagnosis;
  flight.Describe(&diagnosis);
  for (const auto& constant : diagnosis.parameters) {
    EXPECT_TRUE(std::isfinite(constant.sigma)) << constant.name;
  }
}

TEST(DiagnoseRotors, SlowTheBetterModelIsTakenByCalibration) {
  const Hidden hidden{"rotor_tilt", {{"roll", 0.03}, {"pitch", -0.02}}, {0.0025, 0.0025}};
  const FlightLog log = FlyRotorsHiding({{hidden.id, hidden.values}}, 12.0, 6);
  const Diagnosis diagnosis = Diagnose({log}, RotorOptions());
  ExpectOnlyCause(diagnosis, hidden);
  ASSERT_FALSE(diagnosis.causes.empty());
  EXPECT_EQ(diagnosis.verdict, "explained");
  EXPECT_GE(diagnosis.causes[0].gains.arcs.arcs, 8);
  EXPECT_LT(diagnosis.causes[0].gains.arcs.after, diagnosis.causes[0].gains.arcs.before);
  EXPECT_LT(diagnosis.after.rms, diagnosis.before.rms);

  const TestFolder folder;
  WriteDiagnosis(diagnosis, DiagnosisNode(diagnosis, YAML::Node()), folder.directory());
  const YAML::Node yaml = YAML::LoadFile((folder / "diagnosis.yaml").string());
  EXPECT_EQ(yaml["causes"][0]["id"].as<std::string>(), "rotor_tilt");
  EXPECT_EQ(yaml["causes"][0]["parameters"]["roll"]["unit"].as<std::string>(), "rad");
  const RotorCalibrationOptions next =
      ResolveRotorOptions("", (folder / "model.yaml").string(), log);
  EXPECT_NEAR(ModelFor(next, log).effects().tilt_roll, 0.03, 0.005);
  EXPECT_NEAR(next.prior.mean[0], 0.2463, 0.01);
}

void ExpectEachNamed(const std::vector<Hidden>& all) {
  std::vector<SquaredErrors> squares;
  std::uint64_t seed = 8;
  for (const Hidden& hidden : all) {
    const FlightLog log = FlyRotorsHiding({{hidden.id, hidden.values}}, 15.0, seed++);
    squares.push_back(ExpectOnlyCause(Diagnose({log}, RotorOptions(false)), hidden));
  }
  ExpectAsLargeAsStated(squares);
}

TEST(DiagnoseRotors, SlowNamesDragOfTheBody) {
  const FlightLog log =
      FlyRotorsHiding({{"body_drag", {{"c_x", 0.6}, {"c_y", 0.5}, {"c_z", 0.4}}}}, 15.0, 12);
  const Diagnosis diagnosis = Diagnose({log}, RotorOptions(false));
  ASSERT_FALSE(diagnosis.causes.empty());
  const Cause& cause = diagnosis.causes.front();
  EXPECT_EQ(cause.candidate.id(), "body_drag");
  const Eigen::Vector3d truth(0.6, 0.5, 0.4);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(cause.value[i], truth[i], 3.0 * cause.sigma[i]) << i;
}

TEST(DiagnoseRotors, SlowNamesForcesAndThrust) {
  ExpectEachNamed(
      {{"linear_drag", {{"K_x", -0.6}, {"K_y", -0.3}, {"K_z", -0.3}}, {0.052, 0.050, 0.053}},
       {"thrust_sag", {{"d", 0.005}}, {2.9e-4}},
       {"motor_lag", {{"tau", 0.03}}, {2.1e-3}},
       {"air_moment", {{"roll", 1.5e-3}, {"pitch", 2e-3}}, {1.5e-4, 1.6e-4}},
       {"ground_effect", {{"k", 0.3}}, {0.0216}}});
}

TEST(DiagnoseRotors, SlowNamesRotorsAndLoad) {
  ExpectEachNamed(
      {{"rotor_loss", {{"rotor", 1}, {"factor", 0.85}}, {0.0052}},
       {"payload_step", {{"t_step", 9.0}, {"mass", 0.02}}, {7.8e-4}},
       {"com_step", {{"t_step", 9.0}, {"dx", 0.004}, {"dy", -0.003}}, {1.1e-4, 1.1e-4}}});
}

TEST(DiagnoseRotors, SlowFindsTwoAtOnce) {
  const Diagnosis diagnosis =
      Diagnose({FlyRotorsHiding({{"rotor_tilt", {{"roll", 0.03}, {"pitch", -0.03}}},
                                 {"payload_step", {{"t_step", 8.0}, {"mass", -0.02}}}},
                                15.0, 8)},
               RotorOptions(false));
  std::set<std::string> ids;
  for (const Cause& cause : diagnosis.causes) ids.insert(cause.candidate.info->id);
  EXPECT_EQ(ids, (std::set<std::string>{"payload_step", "rotor_tilt"}));
}

// Drag along three axes approximates the two effects together.
TEST(DiagnoseRotors, SlowFindsTwoThatOneCouldStandFor) {
  const Diagnosis diagnosis = Diagnose(
      {FlyRotorsHiding({{"rotor_speed_drag", {{"k", 2e-4}}}, {"rotor_inflow", {{"k", 4e-4}}}}, 10.0,
                       12)},
      RotorOptions(false));
  std::set<std::string> named;
  for (const Cause& cause : diagnosis.causes) {
    named.insert(cause.candidate.info->id);
    named.insert(cause.confused_with.begin(), cause.confused_with.end());
  }
  EXPECT_EQ(named.count("rotor_inflow"), 1u);
  EXPECT_EQ(named.count("rotor_speed_drag"), 1u);
}

// A step between the times that are tried first, so small that the nearest of them misses it.
TEST(DiagnoseRotors, SlowFindsAStepAtItsTime) {
  const Hidden hidden{
      "com_step", {{"t_step", 5.4}, {"dx", 0.0016}, {"dy", -0.0016}}, {1.2e-4, 1.2e-4}};
  const Diagnosis diagnosis =
      Diagnose({FlyRotorsHiding({{hidden.id, hidden.values}}, 10.0, 13)}, RotorOptions(false));
  ExpectOnlyCause(diagnosis, hidden);
  ASSERT_FALSE(diagnosis.causes.empty());
  EXPECT_NEAR(diagnosis.causes[0].candidate.fixed.at("t_step"), 5.4, 0.1);
}

TEST(DiagnoseRotors, SlowWhatNoVehicleHasIsUnexplained) {
  const Diagnosis diagnosis =
      Diagnose({FlyRotorsHiding({{"translational_lift", {{"k", 1.6}}}}, 8.0, 14)}, RotorOptions());
  EXPECT_EQ(diagnosis.verdict, "unexplained");
  EXPECT_THAT(diagnosis.unexplained_by,
              Contains(HasSubstr("translational_lift, of a size or sign")));
  EXPECT_THAT(diagnosis.causes, IsEmpty());
}

// A compass error that depends on the heading; no effect of the catalogue does.
TEST(DiagnoseRotors, SlowDescribesAHeadingThatIsReadWrong) {
  FlightLog log = FlyRotorsHiding({}, 10.0, 15);
  for (PoseSample& pose : log.pose) {
    const double psi = 2.0 * std::atan2(pose.q_E.z(), pose.q_E.w());
    const Eigen::AngleAxisd wrong(0.1 * std::sin(2.0 * psi + 0.5), Eigen::Vector3d::UnitZ());
    pose.q_E = wrong * pose.q_E;
  }
  const Diagnosis diagnosis = Diagnose({log}, RotorOptions());
  EXPECT_EQ(diagnosis.verdict, "unexplained");
  EXPECT_THAT(diagnosis.unexplained_by, Contains("heading, as the attitude is read"));
}

// On further flights: a moment that repeats, and a load that is picked up once.
TEST(DiagnoseRotors, SlowCountsWhatRepeats) {
  const Effect moment{"air_moment", {{"roll", 1.5e-3}, {"pitch", 2e-3}}};
  const Effect load{"payload_step", {{"t_step", 6.0}, {"mass", 0.03}}};
  const Diagnosis both =
      Diagnose({FlyRotorsHiding({moment, load}, 12.0, 10), FlyRotorsHiding({moment}, 12.0, 11)},
               RotorOptions(false));
  ASSERT_EQ(both.causes.size(), 2u);
  for (const Cause& cause : both.causes) {
    const bool stays = cause.candidate.info->id == "air_moment";
    EXPECT_EQ(cause.repeats.at(0).outcome, stays ? "repeats" : "can't be tested");
    EXPECT_EQ(cause.confirmed, stays ? std::optional(true) : std::nullopt)
        << cause.candidate.info->id;
  }
  const Diagnosis once = Diagnose(
      {FlyRotorsHiding({moment}, 12.0, 10), FlyRotorsHiding({}, 12.0, 11)}, RotorOptions(false));
  EXPECT_THAT(once.causes, IsEmpty());  // the other flight's evidence outweighs the first
  ASSERT_FALSE(once.set_aside.empty());
  EXPECT_EQ(once.set_aside[0].candidate.id(), "air_moment");
  EXPECT_EQ(once.set_aside[0].repeats.at(0).outcome, "not shown");
  EXPECT_LT(once.set_aside[0].evidence.other_flights, 0.0);
  EXPECT_EQ(once.verdict, "unexplained");
}

TEST(DiagnoseRotors, SaysWhatIsMissing) {
  FlightLog log = FlyRotorsHiding({}, 3.0, 9);
  log.rotors.clear();
  EXPECT_THROW(Diagnose({log}, RotorOptions()), InputError);
}

}  // namespace
}  // namespace trueline::testing_diagnosis
