// Each part of a column map on a few lines of CSV, with expected values worked out by hand.
#include "problems/import/convert.h"

#include <cmath>

#include "tests/import/import_files.h"

namespace trueline {
namespace {

constexpr char kHeader[] = "t,ax,ay,az,gx,gy,gz,px,py,pz,qw,qx,qy,qz,held,bat\n";
constexpr char kRows[] =
    "10.00,0,0,1,90,0,0,1,2,3,1,0,0,0,5,40\n"
    "10.01,0.1,0.2,1,0,90,0,1,2,3.5,1,0,0,0,5,41\n"
    "10.02,0,0,1,0,0,90,1,2,4,0.70710678,0,0,0.70710678,6,42\n";
constexpr char kStart[] =
    "inputs: {log: {time: {column: t, unit: s}}}\n"
    "earth: ENU\nbody: FLU\n"
    "streams:\n"
    "  imu:\n"
    "    accel: {columns: [ax, ay, az], unit: g}\n"
    "    gyro: {columns: [gx, gy, gz], unit: deg/s}\n";

FlightLog Convert(const std::string& more, const std::string& rows = kRows) {
  return ImportFiles().Convert(kStart + more, kHeader + rows);
}

TEST(Convert, TurnsBodyAxesAndUnits) {
  const FlightLog log = Convert("");
  ASSERT_EQ(log.imu.size(), 3U);
  EXPECT_EQ(log.imu[1].t, 10'010'000'000);
  EXPECT_TRUE(log.imu[1].accel.isApprox(9.80665 * Eigen::Vector3d(0.1, -0.2, -1.0), 1e-12));
  EXPECT_TRUE(log.imu[1].gyro.isApprox(Eigen::Vector3d(0, -M_PI / 2, 0), 1e-12));
  EXPECT_EQ(log.source.at("file"), "log.csv");
  EXPECT_EQ(log.source.at("sha256").size(), 64U);
  EXPECT_EQ(log.environment, "");
  EXPECT_EQ(Convert("environment: indoors\n").environment, "indoors");
}

// East-north-up to north-east-down; a body that faces east and turns left by 90 deg faces north.
TEST(Convert, TurnsEarthAxesAndAttitude) {
  const FlightLog log = Convert(
      "  mocap:\n    position: {columns: [px, py, pz]}\n"
      "    quaternion: {w: qw, x: qx, y: qy, z: qz}\n");
  ASSERT_EQ(log.mocap.size(), 3U);
  EXPECT_TRUE(log.mocap[1].p_E.isApprox(Eigen::Vector3d(2, 1, -3.5), 1e-12));
  const Eigen::Vector3d forward = log.mocap[0].q_E * Eigen::Vector3d::UnitX();
  EXPECT_TRUE(forward.isApprox(Eigen::Vector3d(0, 1, 0), 1e-7));
  EXPECT_TRUE((log.mocap[0].q_E * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d(0, 0, 1)));
  const Eigen::Vector3d turned = log.mocap[2].q_E * Eigen::Vector3d::UnitX();
  EXPECT_TRUE(turned.isApprox(Eigen::Vector3d(1, 0, 0), 1e-7));
}

TEST(Convert, TakesGeneralAxesWithYaw) {
  const FlightLog log = Convert(
      "  mocap:\n    position: {columns: [px, py, pz]}\n"
      "    quaternion: {w: qw, x: qx, y: qy, z: qz}\n"
      "    earth: {axes: [z, -x, -y], yaw_deg: 90}\n    body: {axes: [z, -x, -y]}\n");
  // (1, 2, 3) becomes (3, -1, -2), and 90 deg to the right of that is (1, 3, -2).
  EXPECT_TRUE(log.mocap[0].p_E.isApprox(Eigen::Vector3d(1, 3, -2), 1e-12));
  EXPECT_TRUE((log.mocap[0].q_E * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
}

TEST(Convert, PositionMayHaveAFrameOfItsOwn) {
  const FlightLog log = Convert(
      "  mocap:\n    position: {columns: [px, py, pz], earth: NED}\n"
      "    quaternion: {w: qw, x: qx, y: qy, z: qz}\n");
  EXPECT_TRUE(log.mocap[0].p_E.isApprox(Eigen::Vector3d(1, 2, 3), 1e-12));
  EXPECT_TRUE((log.mocap[0].q_E * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
}

// z-y-x: heading 90 deg, then nose up 30 deg, then right side down 20 deg.
TEST(Convert, ReadsEulerAngles) {
  const FlightLog log = ImportFiles().Convert(
      "inputs: {log: {time: {column: 1, unit: ms, scale: 2}, header: false, delimiter: space}}\n"
      "streams:\n"
      "  imu: {accel: {columns: [2, 3, 4]}, gyro: {columns: [2, 3, 4]}}\n"
      "  attitude: {euler: {roll: 5, pitch: 6, yaw: 7, unit: deg}}\n",
      " 5   1 2 3\t20 30 90\n 6   1 2 3\t20 30 90\n");
  ASSERT_EQ(log.attitude.size(), 2U);
  EXPECT_EQ(log.attitude[0].t, 10'000'000);  // 5 * 2 ms
  const Eigen::Matrix3d R = log.attitude[0].q_Ep_I.toRotationMatrix();
  const double c30 = std::cos(M_PI / 6), s20 = std::sin(M_PI / 9);
  EXPECT_TRUE(R.col(0).isApprox(Eigen::Vector3d(0, c30, -0.5), 1e-12));
  EXPECT_NEAR(R(2, 1), s20 * c30, 1e-12);  // the right side points down
}

TEST(Convert, ScalesOffsetsAndConstants) {
  const FlightLog log = Convert(
      "  battery: {column: bat, unit: V, scale: 0.1, offset: 0.5}\n"
      "  range: {column: 10, unit: cm}\n"
      "  motors: {columns: [gx, gy], scale: [0.01, 0.02], offset: 0.1}\n"
      "  fixes: {position: {columns: [px, py, {constant: 1.5}]}, sigma: {constant: 0.2},\n"
      "          gate: {column: held}, earth: NED}\n");
  EXPECT_NEAR(log.battery[2].value, 4.7, 1e-12);
  EXPECT_NEAR(log.range[1].value, 0.035, 1e-12);
  EXPECT_THAT(log.motors[0].values, ElementsAre(testing::DoubleNear(1.0, 1e-12), 0.1));
  EXPECT_THAT(log.motors[1].values, ElementsAre(0.1, testing::DoubleNear(1.9, 1e-12)));
  EXPECT_EQ(log.fixes[2].p_E, Eigen::Vector3d(1, 2, 1.5));
  EXPECT_EQ(log.fixes[2].sigma, 0.2);
  EXPECT_EQ(log.fixes[2].gate, 6);
}

TEST(Convert, FixSigmaCanBeSet) {
  ConvertOptions options;
  options.fix_sigma = 0.3;
  const FlightLog log = ImportFiles().Convert(
      std::string(kStart) +
          "  fixes: {position: {columns: [px, py, pz]}, sigma: {constant: 0.2}}\n",
      std::string(kHeader) + kRows, options);
  EXPECT_EQ(log.fixes[0].sigma, 0.3);
}

// Specific force in ENU, with a body that faces north: forward in the body is north.
TEST(Convert, TurnsBackAccelerationGivenInEarthAxes) {
  const FlightLog log = ImportFiles().Convert(
      "inputs: {log: {time: {column: t}}}\nearth: ENU\nbody: FLU\n"
      "streams:\n  imu:\n    gyro: {columns: [gx, gy, gz]}\n"
      "    accel: {columns: [ax, ay, az], attitude: {quaternion: {w: qw, x: qx, y: qy, z: qz}}}\n",
      std::string(kHeader) + "1,2,3,9.81,0,0,0,1,2,3,0.70710678,0,0,0.70710678,5,40\n");
  EXPECT_TRUE(log.imu[0].accel.isApprox(Eigen::Vector3d(3, 2, -9.81), 1e-7));
}

TEST(Convert, LeavesRepeatsOut) {
  const FlightLog log = Convert("  range: {column: held, new_where: [held]}\n");
  ASSERT_EQ(log.range.size(), 1U);  // the first row's value is of unknown age
  EXPECT_EQ(log.range[0].t, 10'020'000'000);
  EXPECT_EQ(log.range[0].value, 6.0);
}

TEST(Convert, LeavesSpikesOut) {
  std::string rows;
  for (int i = 0; i < 20; ++i) {
    const double x = i == 7 ? 50.0 : 0.1 * i;
    rows += fmt::format("{},0,0,1,0,0,0,{},0,0,1,0,0,0,0,{}\n", i, x, i == 3 ? 900 : 40);
  }
  const FlightLog log = Convert(
      "  range: {column: px, accept: [{columns: [px], median: {window: 5, within: 1}}]}\n"
      "  battery: {column: bat, accept: [{columns: [bat], range: [0, 100]}]}\n",
      rows);
  EXPECT_EQ(log.range.size(), 19U);
  for (const ScalarSample& sample : log.range) EXPECT_LT(sample.value, 2.0);
  EXPECT_EQ(log.battery.size(), 19U);
  EXPECT_THAT(log.warnings, ElementsAre("battery: rows left out: 1 out of range",
                                        "range: rows left out: 1 far from the running median"));
}

TEST(Convert, SkipsMissingValuesWhereAsked) {
  const std::string rows =
      "1,0,0,1,0,0,0,1,2,,1,0,0,0,5,40\n2,0,0,1,0,0,0,1,2,nan,1,0,0,0,5,41\n"
      "3,0,0,1,0,0,0,1,2,3,1,0,0,0,5,42\n";
  const FlightLog log = Convert("  range: {column: pz, skip_missing: true}\n", rows);
  ASSERT_EQ(log.range.size(), 1U);
  EXPECT_EQ(log.range[0].value, 3.0);
  EXPECT_THAT(log.warnings, ElementsAre("range: rows left out: 2 with missing values"));
}

constexpr char kAttitude[] =
    "  attitude: {quaternion: {w: qw, x: qx, y: qy, z: qz}, skip_missing: true}\n";

TEST(Convert, SkipsABadQuaternionWhereAsked) {
  const std::string rows =
      "1,0,0,1,0,0,0,1,2,3,1,0,0,0,5,40\n2,0,0,1,0,0,0,1,2,3,7,0,0,0,5,41\n"
      "3,0,0,1,0,0,0,1,2,3,0,1,0,0,5,42\n4,0,0,1,0,0,0,1,2,3,,0,0,0,5,42\n";
  const FlightLog log = Convert(kAttitude, rows);
  ASSERT_EQ(log.attitude.size(), 2U);
  EXPECT_EQ(log.attitude[1].t, 3 * kNsPerSecond);
  EXPECT_EQ(log.imu.size(), 4U);
  EXPECT_THAT(log.warnings,
              ElementsAre("attitude: rows left out: 1 with missing values, 1 with a quaternion "
                          "whose norm is not 1"));
}

// Quaternions of which most are bad are those of wrong columns or of another scale.
TEST(Convert, RefusesQuaternionsThatAreBadThroughout) {
  const std::string rows =
      "1,0,0,1,0,0,0,1,2,3,1,0,0,0,5,40\n2,0,0,1,0,0,0,1,2,3,7,0,0,0,5,41\n"
      "3,0,0,1,0,0,0,1,2,3,0,7,0,0,5,42\n";
  EXPECT_THAT(ErrorOf([&] { Convert(kAttitude, rows); }),
              HasSubstr("log.csv:3: column 'qw': the quaternion's norm is 7, not 1"));
}

TEST(Convert, RefusesABadQuaternionUnlessAsked) {
  const std::string rows =
      "1,0,0,1,0,0,0,1,2,3,1,0,0,0,5,40\n2,0,0,1,0,0,0,1,2,3,1,0,0,0,5,41\n"
      "3,0,0,1,0,0,0,1,2,3,0,7,0,0,5,42\n";
  EXPECT_THAT(
      ErrorOf([&] { Convert("  attitude: {quaternion: {w: qw, x: qx, y: qy, z: qz}}\n", rows); }),
      HasSubstr("log.csv:4: column 'qw': the quaternion's norm is 7, not 1"));
}

TEST(Convert, DropsUnsortedRowsWhereAsked) {
  std::string map = std::string(kStart);
  map.replace(map.find("time:"), 0, "unsorted: drop, ");
  const FlightLog log = ImportFiles().Convert(
      map, std::string(kHeader) + kRows + "10.01,0,0,1,0,0,0,1,2,3,1,0,0,0,5,40\n");
  EXPECT_EQ(log.imu.size(), 3U);
  EXPECT_THAT(log.warnings, ElementsAre("imu: rows left out: 1 that came too late"));
}

TEST(Convert, CutsByTime) {
  EXPECT_EQ(Convert("cut: {from: 0.01}\n").imu.front().t, 10'010'000'000);
  EXPECT_EQ(Convert("cut: {to: 10.005, relative_to: clock}\n").imu.size(), 1U);
}

TEST(Convert, CutsToTheTimeInTheAir) {
  const FlightLog log = Convert(
      "  mocap: {position: {columns: [px, py, pz]}, quaternion: {w: qw, x: qx, y: qy, z: qz}}\n"
      "cut: {airborne: {min_height: 0.4}}\n");
  EXPECT_EQ(log.imu.size(), 2U);
  EXPECT_EQ(log.mocap.front().t, 10'010'000'000);
}

// A vehicle that flies already where the recording begins: its start is no ground.
TEST(Convert, KeepsAllOfARecordingThatBeginsAndEndsInFlight) {
  std::string rows;
  for (int i = 0; i < 200; ++i) {
    rows += fmt::format("{:.2f},0,0,1,0,0,0,{:.3f},2,3,1,0,0,0,5,40\n", 10.0 + 0.01 * i, 0.02 * i);
  }
  const FlightLog log = Convert(
      "  mocap: {position: {columns: [px, py, pz]}, quaternion: {w: qw, x: qx, y: qy, z: qz}}\n"
      "cut: {airborne: {min_height: 0.4}}\n",
      rows);
  EXPECT_EQ(log.mocap.size(), 200U);
}

TEST(Convert, ReadsDecimalCommas) {
  const FlightLog log = ImportFiles().Convert(
      "inputs: {log: {delimiter: \";\", decimal: \",\", time: {column: t}}}\n"
      "streams: {imu: {accel: {columns: [x, y, z]}, gyro: {columns: [y, y, y]}}}\n",
      "t;x;y;z\n0,5;1,25;-0,5;9\n0,51;1e-1;0;0\n");
  ASSERT_EQ(log.imu.size(), 2U);
  EXPECT_EQ(log.imu[0].t, 500'000'000);
  EXPECT_EQ(log.imu[0].accel, Eigen::Vector3d(1.25, -0.5, 9.0));
}

TEST(Convert, SaysThatNumbersHaveDecimalCommasAndNamesAnotherDelimiter) {
  const std::string streams =
      "streams: {imu: {accel: {columns: [x, x, x]}, gyro: {columns: [x, x, x]}}}\n";
  const auto error = [&](const std::string& input, const std::string& text) {
    return ErrorOf([&] { ImportFiles().Convert(input + streams, text); });
  };
  EXPECT_THAT(error("inputs: {log: {delimiter: \";\", time: {column: t}}}\n", "t;x\n0;1,5\n"),
              HasSubstr("'1,5' is no number; state a decimal comma in the map's input: decimal"));
  EXPECT_THAT(error("inputs: {log: {time: {column: t}}}\n", "t;x\n0;1\n"),
              HasSubstr("a single name; state the map's input: {delimiter: \";\"}"));
  EXPECT_THAT(error("inputs: {log: {decimal: \",\", time: {column: t}}}\n", "t,x\n0,1\n"),
              HasSubstr("a comma can't be the delimiter, too"));
}

TEST(Convert, JoinsFilesWithClocksOfTheirOwn) {
  const ImportFiles files;
  const std::string map = files.Write(
      "map.yaml",
      "inputs:\n  a: {time: {column: t}}\n"
      "  b: {time: {column: 1, unit: s, offset: {'*two*': -2.5, '*': 7}}, header: false}\n"
      "streams:\n  imu: {accel: {columns: [x, x, x]}, gyro: {columns: [x, x, x]}}\n"
      "  range: {input: b, column: 2}\n");
  const std::string a = files.Write("one.csv", "t,x\n1,0\n2,0\n");
  const std::string b = files.Write("two.csv", "4.5,8\n5.0,9\n");
  const FlightLog log = ConvertLog(ReadImportMap(map), {a, b}, {});
  ASSERT_EQ(log.range.size(), 2U);
  EXPECT_EQ(log.range[0].t, 2 * kNsPerSecond);
  EXPECT_EQ(log.source.at("file"), "one.csv, two.csv");
  EXPECT_THAT(ErrorOf([&] { ConvertLog(ReadImportMap(map), {a}, {}); }),
              HasSubstr("needs 2 files, in this order: a, b; found 1"));
}

}  // namespace
}  // namespace trueline
