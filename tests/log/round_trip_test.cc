// Reading returns what was written: stamps exactly, values to the last digit.
#include "problems/common/random.h"
#include "tests/log/log_files.h"

namespace trueline {
namespace {

constexpr TimeNs kUnixOrigin = 1'772'660'536'302'306'891;  // a host clock, to the nanosecond

FlightLog RandomLog() {
  Random random(7);
  FlightLog log;
  log.name = "round trip";
  log.gravity = 9.8105;
  log.environment = "indoors";
  log.gates = {{3, {3.0, 0.1, -1.5}, 0.25}, {5, {1.0 / 3.0, 5.0, -1.0}, -2.0}};
  log.vehicle = Vehicle{0.2463, {{{0.071, 0.08, 0.0}, {0, 0, -1}, 1, 3.81e-7, 3.62e-9}}};
  log.source = {{"dataset", "none: made up"}};
  for (int i = 0; i < 1000; ++i) {
    const TimeNs t = kUnixOrigin + i * 1'953'125LL;
    const auto q = Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), 1.0);
    log.imu.push_back({t, random.NormalVector3(), random.NormalVector3()});
    log.attitude.push_back({t, q.normalized()});
    log.fixes.push_back({t, random.NormalVector3(), 0.1 + 0.01 * i, i % 4});
    log.pose.push_back({t, random.NormalVector3(), q.normalized()});
    log.mocap.push_back({t - kUnixOrigin - 500'000'000, random.NormalVector3(), q.normalized()});
    log.rotors.push_back({t, {random.Normal(), random.Normal(), random.Normal()}});
    log.motors.push_back({t, {random.Uniform(0, 1), 1e-17}});
    log.battery.push_back({t, random.Normal()});
    log.range.push_back({t, random.Uniform(0, 3)});
  }
  return log;
}

template <class Sample, class Same>
void ExpectSame(const std::vector<Sample>& a, const std::vector<Sample>& b, const Same& same) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].t, b[i].t) << "row " << i;
    ASSERT_TRUE(same(a[i], b[i])) << "row " << i;
  }
}

TEST(RoundTrip, KeepsEveryStream) {
  const FlightLog log = RandomLog(), back = ReadBack(log);
  const auto same_pose = [](const PoseSample& a, const PoseSample& b) {
    return a.p_E == b.p_E && a.q_E.coeffs() == b.q_E.coeffs();
  };
  const auto same_values = [](const auto& a, const auto& b) { return a.values == b.values; };
  const auto same_value = [](const auto& a, const auto& b) { return a.value == b.value; };
  ExpectSame(log.imu, back.imu, [](const ImuSample& a, const ImuSample& b) {
    return a.accel == b.accel && a.gyro == b.gyro;
  });
  ExpectSame(log.attitude, back.attitude, [](const AttitudeSample& a, const AttitudeSample& b) {
    return a.q_Ep_I.coeffs() == b.q_Ep_I.coeffs();
  });
  ExpectSame(log.fixes, back.fixes, [](const Fix& a, const Fix& b) {
    return a.p_E == b.p_E && a.sigma == b.sigma && a.gate == b.gate;
  });
  ExpectSame(log.pose, back.pose, same_pose);
  ExpectSame(log.mocap, back.mocap, same_pose);
  ExpectSame(log.rotors, back.rotors, same_values);
  ExpectSame(log.motors, back.motors, same_values);
  ExpectSame(log.battery, back.battery, same_value);
  ExpectSame(log.range, back.range, same_value);
  EXPECT_TRUE(back.warnings.empty()) << back.warnings.front();
  EXPECT_EQ(back.sha256.size(), 10U);
}

TEST(RoundTrip, KeepsTheDescription) {
  const FlightLog log = RandomLog(), back = ReadBack(log);
  EXPECT_EQ(back.name, log.name);
  EXPECT_EQ(back.gravity, log.gravity);
  EXPECT_EQ(back.environment, "indoors");
  EXPECT_EQ(back.source, log.source);
  ASSERT_EQ(back.gates.size(), 2U);
  EXPECT_EQ(back.gates[1].id, 5);
  EXPECT_EQ(back.gates[1].position, log.gates[1].position);
  EXPECT_EQ(back.gates[0].yaw, 0.25);
  ASSERT_TRUE(back.vehicle.has_value());
  EXPECT_EQ(back.vehicle->mass, 0.2463);
  ASSERT_EQ(back.vehicle->rotors.size(), 1U);
  EXPECT_EQ(back.vehicle->rotors[0].k_f, 3.81e-7);
  EXPECT_EQ(back.vehicle->rotors[0].position, log.vehicle->rotors[0].position);
}

// A stream of an older log in the folder must not become part of the new one.
TEST(RoundTrip, RemovesStreamsThatAreEmptyNow) {
  FlightLog log = RandomLog();
  const TestFolder folder;
  WriteNativeLog(log, folder.directory());
  log.fixes.clear();
  log.range.clear();
  WriteNativeLog(log, folder.directory());
  const FlightLog back = ReadNativeLog(folder.directory());
  EXPECT_TRUE(back.fixes.empty());
  EXPECT_TRUE(back.range.empty());
  EXPECT_EQ(back.mocap.size(), log.mocap.size());
}

}  // namespace
}  // namespace trueline
