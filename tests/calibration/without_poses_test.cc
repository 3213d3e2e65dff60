// What IMU and rotors show without poses: lag, thrust and inertia of simulated flights lie inside
// of their intervals; what filters hide is not shown.
#include "problems/calibration/without_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/inspection/first_look.h"
#include "problems/log/native_log.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

using testing::HasSubstr;

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
