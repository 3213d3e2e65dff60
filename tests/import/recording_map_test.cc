// Maps of recordings: channels, alternatives, times, geodetic positions; what a log without a map
// gets. The recordings are ASL folders, which are text.
#include <cmath>

#include "problems/import/channel_row.h"
#include "problems/import/convert.h"
#include "problems/import/find_map.h"
#include "problems/import/formats/open_recording.h"
#include "tests/import/import_files.h"

namespace trueline {
namespace {

class RecordingMap : public testing::Test {
 protected:
  void SetUp() override {
    Sensor("imu0",
           "#timestamp [ns],a[0],a[1],a[2],w[0],w[1],w[2]\n"
           "1700000000000000030,0,0,-9.81,1,0,0\n"
           "1700000000000000010,0,0,-9.5,2,0,0\n"
           "1700000000000000020,0,0,-9.6,nan,0,0\n"
           "1700000000000000030,0,0,-9.81,1,0,0\n");
    Sensor("gnss",
           "#timestamp [ns],lat,lon,h,eph\n"
           "1700000000000000011,450000000,90000000,100000,1.5\n"
           "1700000000000000021,450000000,90000000,98000,1.5\n"
           "1700000000000000031,450001000,90000000,100000,1.5\n"
           "1700000000000000041,450000000,90001000,100000,1.5\n"
           "1700000000000000051,0,0,0,1.5\n");
  }
  void Sensor(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories(files_ / ("log/" + name));
    files_.Write("log/" + name + "/data.csv", text);
  }
  std::string Log() const { return (files_ / "log").string(); }
  FlightLog Convert(const std::string& streams, const std::string& input = "{format: asl}") const {
    return ConvertLog(ReadImportMap(files_.Write(
                          "map.yaml", "inputs: {log: " + input + "}\nstreams:\n" + streams)),
                      {Log()}, {});
  }
  std::string Error(const std::string& streams) const {
    return ErrorOf([&] { Convert(streams); });
  }

  ImportFiles files_;
};

constexpr char kImu[] =
    "  imu: {channel: imu0, skip_missing: true, accel: {columns: \"a[0..2]\"}, gyro: {columns: "
    "[\"w[0]\", \"w[1]\", \"w[2]\"]}}\n";

// Times exact to a nanosecond; rows are brought to the order of time, and repeats left out.
TEST_F(RecordingMap, ReadsChannelsByName) {
  const FlightLog log = Convert(kImu);
  ASSERT_EQ(log.imu.size(), 2U);
  EXPECT_EQ(log.imu[0].t, 1'700'000'000'000'000'010);
  EXPECT_EQ(log.imu[0].gyro.x(), 2.0);
  EXPECT_EQ(log.imu[1].t, 1'700'000'000'000'000'030);
  EXPECT_THAT(log.warnings, Contains(AllOf(HasSubstr("1 that repeat the one before"),
                                           HasSubstr("1 with missing values"))));
  EXPECT_EQ(log.source.at("file"), "log");
}

TEST_F(RecordingMap, TimesMayBeShifted) {
  const FlightLog log = Convert(kImu, "{format: [ulog, asl], time: {offset: 1.5}}");
  EXPECT_EQ(log.imu[0].t, 1'700'000'001'500'000'010);
}

TEST_F(RecordingMap, TakesTheFirstAlternativeThatTheLogHas) {
  EXPECT_THAT(Error(std::string(kImu) + "  battery: {channel: \"gnss[1]\", column: eph}\n"),
              HasSubstr("has no records of gnss[1]"));
  const std::string second =
      "  battery:\n"
      "    - {channel: power, column: volt}\n"
      "    - {channel: gnss, column: volts}\n"
      "    - {channel: \"gnss[1]\", column: eph}\n"
      "    - {channel: [nothing, \"gn*\"], column: eph}\n";
  EXPECT_EQ(Convert(kImu + second).battery.size(), 5U);
}

// The folder's files are read one after the other, `gnss` first.
TEST_F(RecordingMap, AddsTheLastRecordOfOtherChannels) {
  const FlightLog log = Convert(std::string(kImu) +
                                "  fixes: {channel: imu0, with: [gnss], position: {columns: "
                                "[\"a[2]\", lat, h]}, sigma: {column: eph}}\n");
  ASSERT_EQ(log.fixes.size(), 3U);
  EXPECT_EQ(log.fixes[0].p_E, Eigen::Vector3d(-9.5, 0, 0));
  EXPECT_EQ(log.fixes[0].sigma, 1.5);
  EXPECT_EQ(log.fixes[0].t, 1'700'000'000'000'000'010);
}

// A receiver's first fix may be anywhere; it sets no origin, and is no position of the vehicle.
TEST_F(RecordingMap, AWrongFirstFixSetsNoOrigin) {
  std::string rows = "#timestamp [ns],lat,lon,h\n";
  for (int i = 0; i < 40; ++i) {
    // On both sides of the date line.
    const std::string place = i == 0 ? "0.001,0.001"
                              : i == 1
                                  ? "47.5,179.9999"
                                  : fmt::format("47.0000{:02},{}179.9999", i, i % 2 ? "-" : "");
    rows += fmt::format("{},{},100\n", 1'700'000'000'000'000'000 + i * 100'000'000L, place);
  }
  Sensor("gnss", rows);
  const FlightLog log =
      Convert(std::string(kImu) +
              "  fixes: {channel: gnss, skip_missing: true, position: {geodetic: [lat, lon, h]}, "
              "sigma: {constant: 1}}\n");
  ASSERT_EQ(log.fixes.size(), 38U);
  EXPECT_LT(log.fixes[0].p_E.norm(), 1e-6);
  EXPECT_LT(log.fixes[37].p_E.norm(), 30.0);
  EXPECT_THAT(log.warnings, Contains(HasSubstr("2 more than 10 km from the others")));
}

// Against the radii of curvature of WGS 84 at 45 deg north.
TEST_F(RecordingMap, BringsGeodeticPositionsToALocalFrame) {
  const FlightLog log =
      Convert(std::string(kImu) +
              "  fixes: {channel: gnss, skip_missing: true, position: {geodetic: [lat, lon, h], "
              "scale: [1.0e-7, 1.0e-7, 1.0e-3]}, sigma: {column: eph}}\n");
  ASSERT_EQ(log.fixes.size(), 4U);
  EXPECT_EQ(log.fixes[0].p_E, Eigen::Vector3d::Zero());
  EXPECT_TRUE(log.fixes[1].p_E.isApprox(Eigen::Vector3d(0, 0, 2), 1e-6));
  constexpr double kA = 6378137.0, kE2 = 6.69437999014e-3, kStep = 1e-5 * M_PI / 180.0;
  const double w = std::sqrt(1.0 - kE2 / 2.0);
  EXPECT_NEAR(log.fixes[2].p_E.x(), (kA * (1 - kE2) / (w * w * w) + 100) * kStep * 10, 1e-4);
  EXPECT_NEAR(log.fixes[3].p_E.y(), (kA / w + 100) * std::sqrt(0.5) * kStep * 10, 1e-4);
}

// The fields of a format depend on its version.
TEST_F(RecordingMap, RulesMayBeOfColumnsThatTheLogLacks) {
  const std::string fixes =
      "  fixes: {channel: gnss, position: {columns: [lat, lon, h]}, sigma: {column: eph}, ";
  const FlightLog log =
      Convert(kImu + fixes +
              "accept: [{columns: [frame], range: [0, 1], optional: true}], expect: [{columns: "
              "[frame], range: [0, 1], else: none}, {columns: [h], range: [99000, 200000], else: "
              "are low}]}\n");
  EXPECT_EQ(log.fixes.size(), 5U);
  EXPECT_THAT(log.warnings, Contains("fixes: 2 rows are low"));
  EXPECT_THAT(Error(kImu + fixes + "accept: [{columns: [frame], range: [0, 1]}]}\n"),
              HasSubstr("there is no field 'frame'"));
}

TEST_F(RecordingMap, SaysWhatIsMissing) {
  EXPECT_THAT(Error("  imu: {channel: imu7, accel: {columns: [a, b, c]}, gyro: {columns: [a, b, "
                    "c]}}\n"),
              HasSubstr("has no records of imu7 for stream 'imu'; log the IMU's samples"));
  EXPECT_THAT(Error(std::string(kImu) + "  battery: {channel: power, column: volt}\n"),
              HasSubstr("correct 'channel', or set 'optional: true'"));
  EXPECT_THAT(Error(std::string(kImu) + "  battery: {channel: gnss, column: volt}\n"),
              AllOf(HasSubstr("there is no field 'volt' in gnss"), HasSubstr("lat, lon, h, eph")));
  EXPECT_THAT(Error(std::string(kImu) + "  battery: {column: volt}\n"),
              HasSubstr("give either 'channel' or 'type'"));
  const FlightLog log =
      Convert(std::string(kImu) + "  battery: {channel: power, column: volt, optional: true}\n");
  EXPECT_THAT(log.warnings, Contains(HasSubstr("which would be read, too: battery (power)")));
}

TEST_F(RecordingMap, RefusesAnotherFormat) {
  EXPECT_THAT(ErrorOf([&] { Convert(kImu, "{format: ulog}"); }),
              AllOf(HasSubstr("is of format asl"), HasSubstr("is for ulog")));
  EXPECT_THAT(ErrorOf([&] { Convert(kImu, "{format: ulg}"); }),
              AllOf(HasSubstr("'ulg' is not known"), HasSubstr("ulog (PX4 ULog)")));
  EXPECT_THAT(ErrorOf([&] { Convert(kImu, "{time: {column: t}}"); }), HasSubstr("channel"));
  EXPECT_THAT(ErrorOf([&] { Convert(kImu, "{}"); }), HasSubstr("'inputs.log.time' is missing"));
}

TEST_F(RecordingMap, SaysWhyATextIsNoTrajectory) {
  const std::string map =
      files_.Write("map.yaml", "inputs: {log: {format: asl}, truth: {format: tum}}\nstreams:\n" +
                                   std::string(kImu) +
                                   "  range: {input: truth, channel: trajectory, column: tx}\n");
  const std::string truth = files_.Write("truth.txt", "1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 2\n");
  EXPECT_THAT(ErrorOf([&] {
                ConvertLog(ReadImportMap(map), {Log(), truth}, {});
              }),
              AllOf(HasSubstr("truth.txt: is of format csv"),
                    HasSubstr("line 2 has a quaternion of norm 2, not 1")));
}

TEST_F(RecordingMap, AnImuWithoutNumbersIsSaid) {
  Sensor("imu0",
         "#timestamp [ns],a[0],a[1],a[2],w[0],w[1],w[2]\n"
         "1700000000000000010,nan,0,-9.5,2,0,0\n"
         "1700000000000000020,nan,0,-9.6,1,0,0\n");
  EXPECT_THAT(Error(kImu), AllOf(HasSubstr("rows left out: 2 with missing values"),
                                 HasSubstr("not a number throughout")));
  const std::string strict =
      "  imu: {channel: imu0, accel: {columns: \"a[0..2]\"}, gyro: {columns: \"w[0..2]\"}}\n";
  EXPECT_THAT(Error(strict), HasSubstr("all 2 rows lack values"));
}

TEST_F(RecordingMap, UnusableLogsAreToldFromBadInput) {
  EXPECT_THROW(Convert("  imu: {channel: imu7, accel: {columns: [a, b, c]}, gyro: {columns: [a, b, "
                       "c]}}\n"),
               NoUsableLog);
  FlightLog log;
  log.imu.reserve(100);
  for (int i = 0; i < 100; ++i) {
    log.imu.push_back({i * 10'000'000, {0, 0, -9.81}, Eigen::Vector3d::Zero()});
  }
  EXPECT_THROW(Shortcomings(log, "f"), NoUsableLog);  // no position
  log.mocap.push_back({0, Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity()});
  EXPECT_TRUE(Shortcomings(log, "f").empty());
  for (ImuSample& sample : log.imu) sample.accel = {9.81, 0, 0};
  EXPECT_THAT(Shortcomings(log, "f"), ElementsAre(HasSubstr("90 deg off the body's -z")));
  for (ImuSample& sample : log.imu) sample.t *= 10;
  EXPECT_THROW(Shortcomings(log, "f"), NoUsableLog);  // 10 Hz
}

TEST_F(RecordingMap, ListsChannels) {
  EXPECT_THAT(ListChannels(*OpenRecording(Log())),
              AllOf(HasSubstr("ASL (EuRoC) folder"), HasSubstr("imu0"), HasSubstr("a[0..2]"),
                    HasSubstr("timestamp [ns]")));
}

// The proposal is a map: for a CSV file it converts as it is.
TEST_F(RecordingMap, ProposesAMap) {
  const std::string csv = files_.Write("flight.csv",
                                       "time;acc_x;acc_y;acc_z;gyro_x;gyro_y;gyro_z;pos_x;pos_y;"
                                       "pos_z;q_w;q_x;q_y;q_z;volt\n"
                                       "1;0;0;-9.81;0;0;0.1;1;2;3;1;0;0;0;11\n"
                                       "2;0;0;-9.81;0;0;0.2;1;2;3;1;0;0;0;12\n");
  const std::string proposed = ProposeMap(OpenRecording(csv).get());
  const FlightLog log = ConvertLog(ReadImportMap(files_.Write("map.yaml", proposed)), {csv}, {});
  ASSERT_EQ(log.imu.size(), 2U) << proposed;
  EXPECT_EQ(log.imu[1].gyro.z(), 0.2);
  EXPECT_EQ(log.mocap.front().p_E, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(log.battery.back().value, 12.0);
}

}  // namespace
}  // namespace trueline
