// Calibration from motor commands and battery voltage where no rotor speeds are measured.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "problems/calibration/calibration_config.h"
#include "problems/calibration/rotor_calibration.h"
#include "problems/common/error.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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
  const auto file = std::filesystem::path(testing::TempDir()) / "motors.yaml";
  const auto error = [&](const std::string& motors) -> std::string {
    std::ofstream(file) << "motors: " << motors << "\n";
    try {
      ResolveRotorOptions(file.string(), "", log);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(error("{nominal_voltage: 7.4}"),
              AllOf(HasSubstr("motors.yaml:1"), HasSubstr("full_speed")));
  EXPECT_THAT(error("{full_speed: 2000, nominal_voltage: 7.4, idle: 1.5}"), HasSubstr("below 1"));
  EXPECT_THAT(error("{full_speed: 2000, nominal_voltage: 7.4, kv: 3}"), HasSubstr("kv"));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace trueline
