// Faults of single columns: each is put into a simulated flight, and the first look says so.
#include "problems/inspection/stuck.h"

#include <fmt/format.h>

#include "problems/inspection/first_look.h"
#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

const FlightLog& Flight() {
  static const FlightLog log = testing_simulation::LogOf("hippodrome", 40.0, 5);
  return log;
}

TEST(StuckColumns, AFlightHasNone) {
  const FlightLog log = Flight();
  EXPECT_THAT(FindStuck(ColumnsOf(Stream{"imu"}, log.imu)), IsEmpty());
  EXPECT_THAT(FindStuck(ColumnsOf(Stream{"attitude"}, log.attitude)), IsEmpty());
  EXPECT_THAT(FindStuck(ColumnsOf(Stream{"fixes"}, log.fixes)), IsEmpty());
}

TEST(StuckColumns, NamesColumnAndTime) {
  FlightLog log = Flight();
  for (std::size_t i = 4000; i < 5000; ++i) log.imu[i].accel.x() = log.imu[4000].accel.x();
  const auto stuck = FindStuck(ColumnsOf(Stream{"imu"}, log.imu));
  ASSERT_EQ(stuck.size(), 1U);
  EXPECT_EQ(stuck[0].column, "ax");
  EXPECT_EQ(stuck[0].count, 1000U);
  EXPECT_EQ(stuck[0].stretch.from, log.imu[4000].t);
}

TEST(StuckColumns, OfAFewFixes) {
  FlightLog log = Flight();
  for (std::size_t i = 60; i < 80; ++i) log.fixes[i].p_E.x() = log.fixes[60].p_E.x();
  EXPECT_THAT(FirstLook(log), ElementsAre(HasSubstr("stuck (biases): fixes.csv: x stays at")));
}

// At rest a coarse sensor repeats: one axis at a value, the others to and fro between two.
TEST(StuckColumns, ACoarseSensorAtRestIsNotStuck) {
  FlightLog log = Flight();
  for (std::size_t i = 0; i < 3000; ++i) {
    log.imu[i].gyro = {0.0, (i / 3) % 2 == 0 ? 0.001 : 0.0, i % 5 == 0 ? 0.001 : 0.0};
  }
  EXPECT_THAT(FindStuck(ColumnsOf(Stream{"imu"}, log.imu)), IsEmpty());
}

// A gyroscope in whole degrees a second, 500 Hz, that swings about z but for 0.2 s of a steady
// turn.
std::vector<ImuSample> CoarseSwing() {
  constexpr double kDegree = M_PI / 180.0;
  std::vector<ImuSample> imu;
  for (int i = 0; i < 15000; ++i) {
    const double t = 0.002 * i;
    const double swing = t < 10.0 ? t : std::max(10.0, t - 0.2);
    const Eigen::Vector3d deg(40.0 * std::sin(31.0 * t), 50.0 * std::cos(27.0 * t),
                              200.0 * std::sin(2.5 * swing));
    ImuSample sample{FromSeconds(t), {0.1 * std::sin(40.0 * t), 0.0, -9.81}, {}};
    for (int k = 0; k < 3; ++k) sample.gyro[k] = kDegree * std::round(deg[k]);
    imu.push_back(sample);
  }
  return imu;
}

TEST(StuckColumns, ACoarseSensorThatTurnsSlowlyIsNotStuck) {
  EXPECT_THAT(FindStuck(ColumnsOf(Stream{"imu"}, CoarseSwing())), IsEmpty());
}

TEST(StuckColumns, ACoarseSensorThatReturnsElsewhereWasStuck) {
  std::vector<ImuSample> imu = CoarseSwing();
  for (std::size_t i = 3000; i < 3300; ++i) imu[i].gyro.z() = imu[3000].gyro.z();
  const auto stuck = FindStuck(ColumnsOf(Stream{"imu"}, imu));
  ASSERT_EQ(stuck.size(), 1U);
  EXPECT_EQ(stuck[0].column, "gz");
}

// Samples of a stretch all become the first of it; stamps go on.
template <class Samples>
void Freeze(double from, double until, Samples* samples) {
  const TimeNs start = samples->front().t;
  auto held = samples->front();
  for (auto& sample : *samples) {
    const double t = SecondsBetween(start, sample.t);
    if (t > from && t < until) {
      const TimeNs stamp = sample.t;
      sample = held;
      sample.t = stamp;
    }
    held = sample;
  }
}

// A tracker that loses the vehicle, or a driver that hangs, repeats its last sample.
TEST(FirstLookAtStreams, FindsOneThatStandsStillWhileTheVehicleTurns) {
  FlightLog mocap = Flight(), imu = Flight();
  Freeze(20.0, 23.0, &mocap.mocap);
  EXPECT_THAT(FirstLook(mocap), Contains(HasSubstr("stuck (biases): mocap.csv: one value "
                                                   "is held, while the vehicle moves")));
  Freeze(20.0, 23.0, &imu.imu);
  EXPECT_THAT(FirstLook(imu), Contains(HasSubstr("the attitude turns by")));
}

// No number of a sensor ever changes: there is nothing to compare the stretch with.
TEST(FirstLookAtStreams, FindsSensorsThatMeasureNothing) {
  FlightLog gyro = Flight(), attitude = Flight();
  for (ImuSample& sample : gyro.imu) sample.gyro.setZero();
  EXPECT_THAT(FirstLook(gyro),
              Contains(HasSubstr("dead_axis (fatal): imu.csv: gx, gy and gz keep one")));
  for (AttitudeSample& sample : attitude.attitude) sample.q_Ep_I = attitude.attitude[0].q_Ep_I;
  EXPECT_THAT(FirstLook(attitude),
              Contains(HasSubstr("stuck (fatal): attitude.csv: qw, qx, qy and qz")));
}

// An attitude that never changes is right where the vehicle does not turn, whatever its bias.
TEST(FirstLookAtStreams, AVehicleThatDoesNotTurnMayKeepItsAttitude) {
  FlightLog log = Flight();
  for (AttitudeSample& sample : log.attitude) sample.q_Ep_I = log.attitude[0].q_Ep_I;
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    log.imu[i].gyro = {0.05, i % 2 == 0 ? 0.3 : -0.3, 0.0};
  }
  EXPECT_THAT(FirstLook(log), Not(Contains(HasSubstr("keep one value"))));
}

TEST(FirstLookAtStreams, AVehicleAtRestMayRepeat) {
  FlightLog log = Flight();
  Freeze(20.0, 23.0, &log.mocap);
  const TimeNs start = log.imu.front().t;
  for (ImuSample& sample : log.imu) {
    const double t = SecondsBetween(start, sample.t);
    if (t > 19.9 && t < 23.1) sample.gyro *= 1e-3;
  }
  EXPECT_THAT(FirstLook(log), Not(Contains(HasSubstr("no number changes"))));
}

TEST(FirstLookAtColumns, FindsAnAxisInAnotherUnit) {
  FlightLog log = Flight();
  for (ImuSample& sample : log.imu) sample.accel.y() *= 1e-3;
  EXPECT_THAT(FirstLook(log), UnorderedElementsAre(HasSubstr("dead_axis (biases): imu.csv: ay has"),
                                                   HasSubstr("lateral_force (biases)")));
}

TEST(FirstLookAtColumns, NamesTheOneFault) {
  FlightLog weak = Flight(), knock = Flight();
  for (ImuSample& sample : weak.imu) sample.accel *= 0.9;
  EXPECT_THAT(FirstLook(weak), ElementsAre(HasSubstr("accelerometer_scale (biases)")));
  knock.imu[5000].gyro.x() -= 16.0;
  EXPECT_THAT(FirstLook(knock), ElementsAre(HasSubstr("1 samples of gx stand apart")));
}

// What is done to fixes of a share of the flight or more, and what is said of them.
TEST(FirstLookAtColumns, FindsFixesOfAnotherClockOrHeight) {
  struct Change {
    double from, late, lower, times;
    const char* said;
  };
  for (const Change& c :
       {Change{0.5, 0.5, 0.0, 1.0, "clock_jump (biases)"},
        Change{0.0, 0.5, 0.0, 1.0, "clock_offset (biases)"},
        Change{0.0, 0.0, 5.0, 1.0, "position_spread (biases): z of fixes.csv differs by 5"},
        Change{0.0, 0.0, 0.0, 100.0, "position_spread (fatal): z of fixes.csv differs by"}}) {
    FlightLog log = Flight();
    const auto from = static_cast<std::size_t>(c.from * static_cast<double>(log.fixes.size()));
    for (std::size_t i = from; i < log.fixes.size(); ++i) {
      log.fixes[i].t += FromSeconds(c.late);
      log.fixes[i].p_E.z() = c.times * (log.fixes[i].p_E.z() - c.lower);
    }
    EXPECT_THAT(FirstLook(log), Contains(HasSubstr(c.said)));
  }
}

// Passes of gates, neither at the start nor at the end.
TEST(FirstLookAtColumns, FindsFixesThatWereHeldBack) {
  FlightLog log = Flight();
  const std::size_t from = log.fixes.size() / 3, to = from + 20;
  for (std::size_t i = from; i < to; ++i) log.fixes[i].t += FromSeconds(0.4);
  EXPECT_THAT(FirstLook(log),
              Contains(HasSubstr(
                  fmt::format("clock_jump (biases): the clock of fixes.csv jumps: against mocap, "
                              "fixes from {:.2f} to {:.2f} s come 0.",
                              ToSeconds(log.fixes[from].t), ToSeconds(log.fixes[to - 1].t)))));
}

}  // namespace
}  // namespace trueline
