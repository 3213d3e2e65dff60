// Calibration from motor commands and battery voltage where no rotor speeds are measured.
#include <cmath>
#include <fstream>
#include <map>

#include "problems/calibration/calibration_config.h"
#include "problems/calibration/learn_rotor_noise.h"
#include "problems/calibration/rotor_calibration.h"
#include "problems/calibration/without_poses.h"
#include "problems/common/error.h"
#include "problems/inspection/first_look.h"
#include "problems/log/native_log.h"
#include "problems/rotor/rotor_batch.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

constexpr double kTrueLag = 0.04;  // s

FlightLog FlyOnCommands(double duration, std::uint64_t seed = 3) {
  RotorSimulation sim(WuestVehicle());
  sim.motors = simulation::MotorDriveConfig();
  sim.motor_lag = kTrueLag;
  sim.log_rotors = false;
  return SimulateRotorFlight(sim, RandomPath(duration, 4), seed);
}

// A rough guess of the motors: lag half of the truth, no influence of the voltage.
RotorCalibrationOptions Guessed() {
  RotorCalibrationOptions options(WuestVehicle());
  options.learn_noise = false;
  const simulation::MotorDriveConfig truth;
  options.data.rotors = RotorSource::kMotors;
  options.data.motors = MotorCurve{truth.full_speed, truth.nominal_voltage};
  options.data.motors_at = MotorValues(0.5 * kTrueLag, truth.idle, 0.5);
  const int lag = FindRotorConstant("motor_lag");
  options.prior.mean.segment<kMotorUnknowns>(lag) = options.data.motors_at;
  options.prior.sigma.segment<kMotorUnknowns>(lag) = MotorValues(0.02, 0.0, 0.5);
  options.prior.sigma[FindRotorConstant("k_f")] = 0.1;
  options.prior.sigma[0] = 0.0;  // the vehicle was weighed
  return options;
}

TEST(MotorModel, SlopesAgreeWithDifferences) {
  const MotorCurve curve{2000.0, 7.4};
  const auto later = [&](const MotorValues& at) {
    MotorSpeed speed = SteadySpeed(curve, at, 0.5, 7.0);
    for (int i = 0; i < 3; ++i) {
      speed = AfterLag(speed, SteadySpeed(curve, at, 0.6 + 0.1 * i, 6.8), at[kLag], 0.01);
    }
    return speed;
  };
  const MotorValues at(0.03, 0.2, 0.8);
  for (int i = 0; i < kMotorUnknowns; ++i) {
    const MotorValues h = 1e-6 * MotorValues::Unit(i);
    EXPECT_NEAR((later(at + h).value - later(at - h).value) / 2e-6, later(at).slope[i],
                1e-4 * std::abs(later(at).slope[i]))
        << i;
  }
  EXPECT_EQ(SteadySpeed(curve, at, 0.0, 7.0).value, 0.0);
}

// The simulator has its own code for motors: speeds computed from its commands and battery must
// equal those that it logs.
TEST(MotorCommands, TurnRotorsAsTheSimulatorDoes) {
  RotorSimulation sim(WuestVehicle());
  sim.motors = simulation::MotorDriveConfig();
  sim.motors->battery_sigma = 0.0;
  sim.motors->battery_rate = sim.imu_rate;
  sim.motor_lag = kTrueLag;
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(5.0, 4), 3);
  RotorDataOptions options;
  const RotorData measured = MakeRotorData(log, 4, options);
  options.rotors = RotorSource::kMotors;
  options.motors = MotorCurve{sim.motors->full_speed, sim.motors->nominal_voltage};
  options.motors_at = MotorValues(kTrueLag, sim.motors->idle, sim.motors->voltage);
  const RotorData driven = MakeRotorData(log, 4, options);
  double farthest = 0.0;
  for (double t = 1.0; t < 4.5; t += 0.01) {
    for (int i = 0; i < 4; ++i) {
      farthest =
          std::max(farthest, std::abs(driven.InputAt(t).speeds[i] - measured.InputAt(t).speeds[i]));
    }
  }
  EXPECT_LT(farthest, 0.5);  // rad/s, of 1250
}

TEST(MotorCommands, LagAndVoltageAreFoundSlow) {
  const RotorCalibration c = CalibrateRotors(FlyOnCommands(20.0), Guessed());
  EXPECT_EQ(c.verdict.word, "usable") << (c.verdict.reasons.empty() ? "" : c.verdict.reasons[0]);
  const std::map<std::string, double> truth = {
      {"motor_lag", kTrueLag}, {"motor_voltage", 1.0}, {"k_f", 1.0}, {"r_BM_x", 0.003}};
  for (const ParameterEstimate& p : c.parameters) {
    if (truth.count(p.name) == 0) continue;
    EXPECT_NEAR(p.value, truth.at(p.name), 3.5 * p.sigma) << p.name;
    EXPECT_EQ(p.status, "identified") << p.name;
  }
  EXPECT_LT(c.batch.Sigma()[FindRotorConstant("motor_lag")], 0.003);
  EXPECT_LT(c.predictions[1].after, c.predictions[1].before);
}

std::string ErrorOf(const FlightLog& log, const RotorCalibrationOptions& options) {
  return trueline::ErrorOf([&] { CalibrateRotors(log, options); });
}

TEST(MotorCommands, WhatIsMissingIsNamed) {
  FlightLog log = FlyOnCommands(3.0);
  EXPECT_THAT(ErrorOf(log, RotorCalibrationOptions(WuestVehicle())),
              AllOf(HasSubstr("no rotors.csv"), HasSubstr("motors.csv"), HasSubstr("--config")));
  RotorCalibrationOptions options = Guessed();
  options.data.motors_at[kLag] = 0.0;
  EXPECT_THAT(ErrorOf(log, options), HasSubstr("lag must be above 0 s"));
  log.battery.clear();
  EXPECT_THAT(ErrorOf(log, Guessed()), AllOf(HasSubstr("battery.csv"), HasSubstr("voltage: 0")));
  log.motors.clear();
  EXPECT_THAT(ErrorOf(log, Guessed()), HasSubstr("no motors.csv"));
  EXPECT_THAT(ErrorOf(log, RotorCalibrationOptions(WuestVehicle())), HasSubstr("neither"));
  RotorSimulation sim(WuestVehicle());
  RotorCalibrationOptions measured(WuestVehicle());
  measured.prior.sigma[FindRotorConstant("motor_lag")] = 0.02;
  measured.learn_noise = false;
  EXPECT_THAT(ErrorOf(SimulateRotorFlight(sim, RandomPath(6.0, 4), 3), measured),
              HasSubstr("motor commands only"));
}

TEST(MotorCommands, WrongMotorsAreRefusedByName) {
  const FlightLog log = FlyOnCommands(3.0);
  const TestFolder folder;
  const std::string file = folder / "motors.yaml";
  const auto error = [&](const std::string& motors) -> std::string {
    std::ofstream(file) << "motors: " << motors << "\n";
    return trueline::ErrorOf([&] { ResolveRotorOptions(file, "", log); });
  };
  EXPECT_THAT(error("{nominal_voltage: 7.4}"),
              AllOf(HasSubstr("motors.yaml:1"), HasSubstr("full_speed")));
  EXPECT_THAT(error("{full_speed: 2000, nominal_voltage: 7.4, idle: 1.5}"), HasSubstr("below 1"));
  EXPECT_THAT(error("{full_speed: 2000, nominal_voltage: 7.4, kv: 3}"), HasSubstr("kv"));
}

// --- Inertia of a vehicle whose autopilot holds against moments that no log shows, and moments of
// the air on rotors that the simulator computes by blade elements.

RotorBatchResult Fitted(const RotorSimulation& sim, const RotorData& data, const RotorNoise& noise,
                        const RotorPrior& prior) {
  RotorBatchOptions options;
  options.noise = noise;
  options.prior = prior;
  return RunRotorBatch(EstimationModel(sim.vehicle), data, options);
}

// Eddies are no Gauss-Markov process; flights differ by seed.
TEST(SlowMoments, DoNotInflateInertiaOnceTheDriftIsLearned) {
  constexpr int kFlights = 3;
  double white_ratio = 0.0, learned_ratio = 0.0;
  for (int seed = 1; seed <= kFlights; ++seed) {
    RotorSimulation sim(WuestVehicle());
    sim.slow_moments = 5.0;
    RotorTruth truth;
    const FlightLog log = SimulateRotorFlight(sim, RandomPath(10.0, seed), seed, &truth);
    const RotorData data = MakeRotorData(log, 4, {});
    RotorEkfOptions filter;
    filter.noise = sim.noise;
    filter.prior = DrawnPrior(WuestVehicle(), seed);
    const RotorAeroModel model = EstimationModel(sim.vehicle);
    const RotorNoise learned = LearnRotorNoise(model, data, filter, sim.noise).noise;
    EXPECT_GT(learned.angular_drift, 2.0);
    RotorNoise white = learned;
    white.angular_drift = 0.0;
    white.angular_density = 5.0;  // what is left to explain the eddies
    const RotorBatchResult without = Fitted(sim, data, white, filter.prior);
    const RotorBatchResult with = Fitted(sim, data, learned, filter.prior);
    for (int i = kInertiaConstants; i < kInertiaConstants + 2; ++i) {
      EXPECT_NEAR(with.mean[i], truth.constants[i], 4.0 * with.Sigma()[i]);
      white_ratio += without.mean[i] / truth.constants[i] / (2.0 * kFlights);
      learned_ratio += with.mean[i] / truth.constants[i] / (2.0 * kFlights);
    }
  }
  EXPECT_NEAR(learned_ratio, 1.0, 0.05);
  EXPECT_GT(std::abs(white_ratio - 1.0), 2.0 * std::abs(learned_ratio - 1.0));
}

TEST(SlowMoments, NoDriftIsLearnedOnAFlightWithout) {
  const RotorSimulation sim(WuestVehicle());
  const RotorData data = MakeRotorData(SimulateRotorFlight(sim, RandomPath(8.0, 4), 3), 4, {});
  RotorEkfOptions filter;
  filter.noise = sim.noise;
  filter.prior = DrawnPrior(WuestVehicle(), 2);
  const LearnedNoise learned =
      LearnRotorNoise(EstimationModel(sim.vehicle), data, filter, sim.noise);
  EXPECT_LT(learned.noise.angular_drift, 0.5);
}

// Blade elements brake turns and flap in the wind of flight; no constant of theirs is the
// estimator's.
TEST(AirTurn, DampingOfBladesIsFoundAndPredictsBetter) {
  RotorSimulation sim(WuestVehicle());
  sim.blades.emplace();
  const RotorData data = MakeRotorData(SimulateRotorFlight(sim, RandomPath(12.0, 2), 5), 4, {});
  RotorPrior plain = PriorFromVehicle(WuestVehicle());
  for (const char* name : {"K_x", "K_y", "K_z"}) plain.sigma[FindRotorConstant(name)] = 0.5;
  RotorPrior free = plain;
  for (const char* name : {"L_p", "M_q", "N_r"}) free.sigma[FindRotorConstant(name)] = 20.0;
  for (const char* name : {"L_v", "M_u"}) free.sigma[FindRotorConstant(name)] = 10.0;
  const RotorBatchResult without = Fitted(sim, data, sim.noise, plain);
  const RotorBatchResult with = Fitted(sim, data, sim.noise, free);
  for (const char* name : {"L_p", "M_q"}) {
    const int i = FindRotorConstant(name);
    EXPECT_LT(with.mean[i], -5.0 * with.Sigma()[i]) << name;
  }
  EXPECT_GT(with.log_evidence, without.log_evidence + 50.0);
}

// Rotors of 2e-5 kg m^2 turn the vehicle against themselves as they speed up, as the airframe of
// the simulator computes by their angular momentum.
TEST(RotorInertia, IsFoundAndRightsTheYaw) {
  RotorSimulation sim(WuestVehicle());
  sim.rotor_inertia = 2e-5;
  RotorTruth truth;
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(12.0, 2), 5, &truth);
  const RotorData data = MakeRotorData(log, 4, {});
  const RotorPrior plain = PriorFromVehicle(WuestVehicle());
  RotorPrior free = plain;
  const int at = FindRotorConstant("J_r"), yaw = FindRotorConstant("I_z");
  free.sigma[at] = 5e-5;
  const RotorBatchResult without = Fitted(sim, data, sim.noise, plain);
  const RotorBatchResult with = Fitted(sim, data, sim.noise, free);
  EXPECT_NEAR(with.mean[at], 2e-5, 4.0 * with.Sigma()[at]);
  EXPECT_LT(with.Sigma()[at], 3e-6);
  EXPECT_NEAR(with.mean[yaw], truth.constants[yaw], 4.0 * with.Sigma()[yaw]);
  EXPECT_GT(with.log_evidence, without.log_evidence + 50.0);
}

// --- What IMU and rotors show without poses: lag, thrust and inertia of simulated flights lie
// inside of their intervals; what filters hide is not shown.

constexpr double kFlownLag = 0.035;  // s

RotorSimulation FlownByCommands() {
  RotorSimulation simulation(WuestVehicle());
  simulation.noise.accel = 0.4, simulation.noise.gyro = 0.02;
  simulation.noise.force_density = 0.05, simulation.noise.angular_density = 0.2;
  simulation.drag.setConstant(-0.3);
  simulation.motor_lag = kFlownLag;
  simulation.motors.emplace().full_speed = 2200.0;
  return simulation;
}

FlightLog LogWithoutPoses(const RotorSimulation& simulation, std::uint64_t seed) {
  FlightLog log = SimulateRotorFlight(simulation, RandomPath(40.0, seed), seed);
  log.pose.clear(), log.mocap.clear();
  log.directory = "flight";
  return log;
}

const ParameterEstimate* Find(const PoselessCalibration& c, const std::string& name) {
  const auto found = std::ranges::find(c.parameters, name, &ParameterEstimate::name);
  return found == c.parameters.end() ? nullptr : &*found;
}

void ExpectInside(const PoselessCalibration& c, const std::string& name, double truth) {
  const ParameterEstimate* p = Find(c, name);
  ASSERT_NE(p, nullptr) << name << "\n" << CalibrationTable(c);
  EXPECT_NEAR(p->value, truth, 2.5 * p->sigma) << name;
  EXPECT_LT(p->sigma, 0.15 * truth) << name;
}

TEST(WithoutPosesTest, SlowShowsLagThrustAndInertia) {
  const RotorCalibrationOptions options(WuestVehicle());
  const std::vector<double>& truth = options.vehicle.parameters;
  for (const bool by_speeds : {true, false}) {
    FlightLog log = LogWithoutPoses(FlownByCommands(), 2);
    if (!by_speeds) log.rotors.clear();
    const PoselessCalibration c = CalibrateWithoutPoses(log, options);
    ExpectInside(c, "motor_lag", kFlownLag);
    ExpectInside(c, "I_x", truth[RotorDrivenModel::kInertia]);
    ExpectInside(c, "I_y", truth[RotorDrivenModel::kInertia + 1]);
    if (by_speeds) ExpectInside(c, "k_f", 1.0);
    EXPECT_EQ(c.verdict.word, "usable");
  }
}

TEST(WithoutPosesTest, SlowDoesNotShowWhatFiltersHide) {
  RotorSimulation simulation = FlownByCommands();
  simulation.gyro_cutoff = 20.0;
  const PoselessCalibration c = CalibrateWithoutPoses(LogWithoutPoses(simulation, 3),
                                                      RotorCalibrationOptions(WuestVehicle()));
  EXPECT_EQ(Find(c, "I_x"), nullptr) << CalibrationTable(c);
  EXPECT_THAT(CalibrationTable(c), HasSubstr("smoothed"));
}

// A log without positions is read for this use alone.
TEST(WithoutPosesTest, OthersRefuseALogWithoutPositions) {
  TestFolder folder;
  FlightLog log = LogWithoutPoses(FlownByCommands(), 4);
  log.name = "flight";
  WriteNativeLog(log, folder.directory());
  EXPECT_THAT(trueline::ErrorOf([&] { ReadNativeLog(folder.directory()); }),
              HasSubstr("--drive=rotors"));
  EXPECT_THAT(trueline::ErrorOf([&] { ReadAndLook(folder.directory(), nullptr, ForDrive::kImu); }),
              HasSubstr("--drive=rotors"));
  EXPECT_FALSE(HasPositions(ReadAndLook(folder.directory(), nullptr, ForDrive::kRotors)));
  log.rotors.clear(), log.motors.clear();
  EXPECT_THAT(trueline::ErrorOf(
                  [&] { CalibrateWithoutPoses(log, RotorCalibrationOptions(WuestVehicle())); }),
              HasSubstr("motors.csv"));
}

}  // namespace
}  // namespace trueline
