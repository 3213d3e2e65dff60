// What a rotor-driven fit takes from a log.
#include "problems/rotor/rotor_data.h"

#include <gmock/gmock.h>

#include "problems/common/error.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

FlightLog Fly(bool commands) {
  RotorSimulation sim(WuestVehicle());
  if (commands) {
    sim.motors = simulation::MotorDriveConfig();
    sim.motor_lag = 0.03;
    sim.log_rotors = false;
  }
  return SimulateRotorFlight(sim, RandomPath(6.0, 4), 3);
}

RotorDataOptions OnCommands() {
  const simulation::MotorDriveConfig truth;
  RotorDataOptions options;
  options.rotors = RotorSource::kMotors;
  options.motors = MotorCurve{truth.full_speed, truth.nominal_voltage};
  options.motors_at = MotorValues(0.03, truth.idle, truth.voltage);
  return options;
}

std::string ErrorOf(const FlightLog& log, const RotorDataOptions& options) {
  return trueline::ErrorOf([&] { MakeRotorData(log, 4, options); });
}

TEST(RotorData, APartWithoutPosesIsRefused) {
  FlightLog log = Fly(false);
  const TimeNs begin = log.imu.front().t;
  std::erase_if(log.pose, [&](const PoseSample& pose) {
    const double t = SecondsBetween(begin, pose.t);
    return t > 2.0 && t < 5.0;
  });
  RotorDataOptions options;
  EXPECT_EQ(ErrorOf(log, options), "no error");
  options.start = 2.5;
  options.duration = 2.0;
  EXPECT_THAT(ErrorOf(log, options), AllOf(HasSubstr("0 poses"), HasSubstr("start and end")));
}

TEST(RotorData, ABatteryOfZeroVoltsIsRefused) {
  FlightLog log = Fly(true);
  EXPECT_EQ(ErrorOf(log, OnCommands()), "no error");
  for (ScalarSample& sample : log.battery) sample.value = 0.0;
  EXPECT_THAT(ErrorOf(log, OnCommands()), AllOf(HasSubstr("battery.csv"), HasSubstr("0 V")));
}

// Idle motors before the part that is fitted change nothing: neither its noise nor its speeds.
TEST(RotorData, SpeedsLongBeforeThePartDoNotCount) {
  FlightLog log = Fly(false);
  RotorDataOptions options;
  options.start = 3.0;
  const RotorData as_flown = MakeRotorData(log, 4, options);
  const TimeNs begin = log.imu.front().t;
  double sign = 1.0;
  for (ChannelsSample& sample : log.rotors) {
    if (SecondsBetween(begin, sample.t) > 1.5) break;
    sign = -sign;
    for (double& speed : sample.values) speed = 200.0 + 100.0 * sign;
  }
  const RotorData idle_first = MakeRotorData(log, 4, options);
  EXPECT_EQ(idle_first.measured.model.sigma, as_flown.measured.model.sigma);
  EXPECT_EQ(idle_first.speeds, as_flown.speeds);
}

// The unknown motor_lag and a lag beyond it delay the speeds alike.
TEST(RotorData, AddedLagIsBeyondTheUnknownOne) {
  const FlightLog log = Fly(true);
  RotorDataOptions longer = OnCommands(), added = OnCommands();
  longer.motors_at[kLag] = 0.05;
  added.motor_lag = 0.02;
  const RotorData a = MakeRotorData(log, 4, longer), b = MakeRotorData(log, 4, added);
  EXPECT_DOUBLE_EQ(b.motors_at[kLag], 0.03);
  for (const double t : {1.0, 2.0, 3.0}) {
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(a.InputAt(t).speeds[i], b.InputAt(t).speeds[i], 1e-9);
    }
  }
}

TEST(RotorData, ANegativeLagIsClamped) {
  RotorData data = MakeRotorData(Fly(true), 4, OnCommands());
  data.SimulateMotors(MotorValues(-0.01, 0.1, 1.0));
  EXPECT_GT(data.motors_at[kLag], 0.0);
  for (const auto& speeds : data.speeds) {
    for (const double speed : speeds) EXPECT_TRUE(std::isfinite(speed));
  }
}

}  // namespace
}  // namespace trueline
